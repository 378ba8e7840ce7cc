"""A bag whose recorder was not told what is flown: the plant says it, and the bag has it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from space_robot_msgs_py.bag.description import read_description
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import Timebase
from space_robot_msgs_py.wire.sources import Claimed

FLOWN = {"robot": "mine", "robot_file": {"robot": {"name": "mine"}}, "period": 0.001}
PLANT, FOREIGN = b"p" * 16, b"f" * 16


class Publishers:
    """The plant has claimed its topics."""

    def claimed(self, topic: str) -> Claimed:
        return Claimed((PLANT,), is_held=True)

    def names(self, topic: str) -> dict[bytes, str]:
        return {PLANT: "/plant_node", FOREIGN: "/other"}


def recorder(path: Path, **flight: Any) -> BagRecorder:
    return BagRecorder(path, flight, Timebase(500_000), publishers=Publishers())


def described(path: Path) -> dict[str, Any]:
    return read_description(open_bag(path).custom_data())


@pytest.mark.parametrize("is_finished", [True, False])
def test_what_the_plant_says_is_in_the_bag(tmp_path: Path, is_finished: bool) -> None:
    """Also in one whose recorder is killed, and what the recorder was told counts."""
    bag = recorder(tmp_path / "bag", period=0.0005)
    bag.describe(FLOWN, PLANT, 1)
    if is_finished:
        bag.close()
    assert described(tmp_path / "bag") == {**FLOWN, "period": 0.0005}


@pytest.mark.parametrize("flown", [None, [], "robot", 3.0])
def test_what_is_no_description_is_ignored(tmp_path: Path, flown: object) -> None:
    bag = recorder(tmp_path / "bag", period=0.0005)
    bag.describe(flown, PLANT, 1)
    bag.describe({**FLOWN, "robot": "foreign"}, FOREIGN, 1)
    bag.close()
    assert described(tmp_path / "bag") == {"period": 0.0005}


def test_a_recorder_that_was_told_the_robot_keeps_what_it_was_told(tmp_path: Path) -> None:
    told = {"robot": "paper", "robot_file": {"robot": {"name": "paper"}}}
    bag = recorder(tmp_path / "bag", **told)
    bag.describe({**FLOWN, "faults": ["drop_state@1"]}, PLANT, 1)
    bag.close()
    assert described(tmp_path / "bag") == told
