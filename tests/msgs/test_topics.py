"""Topics' quality of service, errors on their way to another process, times of a flight."""

from __future__ import annotations

import math
import pickle
import re
import subprocess
import sys
from fractions import Fraction
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG, DOCS, ROOT

from space_robot.flight.graph.following import InterruptedFlightError
from space_robot_control.flight_code.c99.language import NotInSubsetError
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import (
    DivergedError,
    InputError,
    MessageError,
    SingularAttitudeError,
    SpaceRobotError,
    UnusableStateError,
)
from space_robot_msgs_py.ros.locks import HeldError, Holder
from space_robot_msgs_py.samples import RobotNames, Timebase
from space_robot_msgs_py.simulated_time import LATEST_S, check_time, shortest, tick_from
from space_robot_msgs_py.telemetry.telecommands import FailureCode, TelecommandError
from space_robot_msgs_py.wire.messages import describe

OVERRIDES = CONFIG / "qos/record_overrides.yaml"


def test_overrides_for_ros2_bag_record_are_the_topics_own() -> None:
    """Every topic with its depth and durability, and no other."""
    expected = {
        topic.full_name: {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
        }
        for topic in (*topics.RECORDED, *topics.FOR_OTHERS)
    }
    assert yaml.safe_load(OVERRIDES.read_text("utf-8")) == expected


@pytest.mark.parametrize("page", ["bags", "namespaces"])
def test_overrides_of_a_robot_in_a_namespace_have_its_topics(page: str) -> None:
    """By the commands of the pages; topics of the whole domain keep their names."""
    found = re.findall(r"^    sed -E '(.+)' ", (DOCS / f"manual/{page}.md").read_text(), re.M)
    everywhere = (*topics.RECORDED, *topics.FOR_OTHERS)
    assert found
    for number, expression in enumerate(found, 1):
        command = ["sed", "-E", expression, str(OVERRIDES)]
        told = subprocess.run(command, capture_output=True, check=True, text=True).stdout
        assert set(yaml.safe_load(told)) == {t.in_namespace(f"/sat{number}") for t in everywhere}


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.full_name)
def test_our_own_message_fits_its_description(topic: topics.Topic) -> None:
    """But for a law's, which has no columns of numbers."""
    if topic is not topics.LAW:
        described = describe(topic, RobotNames(("a", "b"), ("c",), ("d",)), Timebase(500_000))
        width = described.width
        assert not width or len(described.own(3).offsets) in (width, 3 * width)


def test_the_recorder_starts_without_the_compiler() -> None:
    """Half a second sooner; the descriptions of messages need it as little."""
    modules = ["space_robot_msgs_py.bag.recorder", "space_robot_msgs_py.bag.message_accounting"]
    modules += [f"space_robot_msgs_py.wire.{name}" for name in ("messages", "telemetry", "viewers")]
    program = f"import sys, {', '.join(modules)}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0


MADE: dict[type[SpaceRobotError], SpaceRobotError] = {
    DivergedError: DivergedError(11, 0.0005, "why"),
    UnusableStateError: UnusableStateError(3, "is not finite", "not finite"),
    SingularAttitudeError: SingularAttitudeError(4),
    MessageError: MessageError("text", "late"),
    NotInSubsetError: NotInSubsetError("law.py", 12, "recursion", "write a loop"),
    HeldError: HeldError(Path("lock"), Holder("plant (pid 1)", 2)),
    TelecommandError: TelecommandError(FailureCode.REFUSED, "why"),
    InterruptedFlightError: InterruptedFlightError("stopped", 2),
}
"""Those whose constructors want more than a text."""


def _below(kind: type[SpaceRobotError]) -> list[type[SpaceRobotError]]:
    return [kind, *(other for sub in kind.__subclasses__() for other in _below(sub))]


def test_every_error_arrives_as_it_left() -> None:
    for file in ROOT.glob("space_robot*/**/*.py"):
        if re.search(r"^class \w+Error\(", file.read_text("utf-8"), re.MULTILINE):
            import_module(".".join(file.relative_to(ROOT).with_suffix("").parts))
    kinds = _below(SpaceRobotError)
    assert len(kinds) > 15
    for kind in kinds:
        error: Any = MADE.get(kind) or kind("text")
        error.log = "what was flown"
        arrived = pickle.loads(pickle.dumps(error))
        assert type(arrived) is kind
        assert str(arrived) == str(error)
        assert vars(arrived) == vars(error)
        assert arrived.exit_code == error.exit_code


def test_a_time_is_from_zero_to_the_latest() -> None:
    assert LATEST_S / 10e-6 < 2**63, "of the shortest period, too, its tick fits in 64 bits"
    for seconds in (0.0, LATEST_S):
        check_time(seconds)
    for seconds in (-1e-9, math.nextafter(LATEST_S, math.inf), math.inf, math.nan):
        with pytest.raises(InputError, match=r"^END must be from 0 to 1e\+09 s, got "):
            check_time(seconds, "END")
    with pytest.raises(InputError, match=r"^T must be .*, got -1$"):
        check_time(-1.0)


@given(st.floats(0.0, LATEST_S))
def test_the_shortest_text_is_the_same_number(seconds: float) -> None:
    assert float(shortest(seconds)) == seconds
    assert not shortest(seconds).endswith(".0")
    written = {0.0: "0", 10.0: "10", 0.1: "0.1", 1e-7: "1e-07", 100.05: "100.05"}
    assert {number: shortest(number) for number in written} == written


@given(st.integers(0, 10**8), st.integers(20, 100_000).map(lambda us: us * 1e-6))
def test_the_time_of_a_tick_falls_on_it_and_a_little_more_on_the_next(
    tick: int, period: float
) -> None:
    assert tick_from(tick * period, period) == tick
    exact = (tick + Fraction(1, 1000)) * Fraction(period)
    assert tick_from(float(exact), period) == tick + 1
    assert tick_from(float((tick + Fraction(1, 10**8)) * Fraction(period)), period) == tick
    assert tick_from(1e308, 1e-3) == tick_from(math.inf, 1e-3) == math.inf
