"""What must be touched for something new: no more than the table in CONTRIBUTING.md says."""

from __future__ import annotations

import importlib
import sys
from collections.abc import Iterator
from pathlib import Path

import click
import numpy as np
import pytest
from bags import messages_of, read_accounts
from flights import planned, simulated
from paths import CONFIG, ROOT

import space_robot.cli as room_of_commands
import space_robot_control.laws as room_of_laws
from space_robot import load_bag
from space_robot.cli.main import COMMANDS, cli
from space_robot.flight.compilation import laws_with_gains
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag import rows
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import CommandSignals, RobotNames
from space_robot_msgs_py.signals import Reporter, signal
from space_robot_msgs_py.wire.definitions import decode
from space_robot_msgs_py.wire.messages import Codec, describe

MODEL = "tde_stc"
"""The law that the new one is a copy of."""


@pytest.fixture
def new_law(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Path]:
    """A law's file as if it were in laws/, and the folder of its gains."""
    folder, gains = tmp_path / "laws", tmp_path / "gains"
    folder.mkdir()
    gains.mkdir()
    source = ROOT / f"space_robot_control/laws/{MODEL}.py"
    (folder / "newest.py").write_text(source.read_text("utf-8").replace(f'"{MODEL}"', '"newest"'))
    given = (CONFIG / f"gains/paper/tuned/{MODEL}.yaml").read_text("utf-8")
    (gains / "newest.yaml").write_text(given.replace(MODEL, "newest"))
    monkeypatch.setattr(room_of_laws, "__path__", [*room_of_laws.__path__, str(folder)])
    laws.cache_clear()
    yield gains
    laws.cache_clear()
    sys.modules.pop(f"{room_of_laws.__name__}.newest", None)


def test_a_law_is_one_file_in_laws_and_one_of_gains(new_law: Path) -> None:
    """It is found by its name, and flies in compiled code as the one it is a copy of.

    Without gains of the default robot it does not stop the compilation of the others.
    """
    assert "newest" in laws()
    assert laws_with_gains().keys() == laws().keys() - {"newest"}
    own = simulate(planned(controller="newest", gains=str(new_law), duration=0.01))
    model = simulated(controller=MODEL, gains="tuned", duration=0.01)
    assert own.commanded_torque is not None
    assert model.commanded_torque is not None
    np.testing.assert_array_equal(own.commanded_torque, model.commanded_torque)


def test_a_law_stands_in_one_file_of_its_name() -> None:
    for name, law in laws().items():
        assert law.__module__ == f"{room_of_laws.__name__}.{name}"
        assert importlib.import_module(law.__module__).__doc__


def test_a_signal_is_one_line_and_its_topic_another(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It is laid out, recorded, counted, and missed, as all others are."""
    newest = topics.Topic("newest", "sensor_msgs/msg/Temperature", 100, per_tick=True)
    declared = signal(Reporter.OTHERS, 1, "K", "", "how warm it is").sent(newest, "temperature")
    monkeypatch.setattr(CommandSignals, "newest", declared, raising=False)
    monkeypatch.setattr(rows, "NOT_READ", (*rows.NOT_READ, newest))  # a log has no such column
    monkeypatch.setattr(topics, "ALL", (*topics.ALL, newest))
    monkeypatch.setattr(topics, "RECORDED", (*topics.RECORDED, newest))
    monkeypatch.setitem(topics.BY_NAME, newest.full_name, newest)
    flight = planned(duration=0.01)
    names = RobotNames(flight.robot.joint_names)
    codec = Codec(describe(newest, names, flight.timebase))
    simulate(flight, tmp_path / "flown")
    recorder = BagRecorder(tmp_path / "bag", flight.description, flight.timebase)
    for topic, data in messages_of(tmp_path / "flown"):
        recorder.record(topic, data)
    for tick in range(20):
        if tick != 9:
            recorder.record(newest, codec.encode(flight.timebase.stamp_ns(tick), np.array([tick])))
    recorder.close()
    recorded = [data for topic, data in messages_of(tmp_path / "bag") if topic is newest]
    assert [decode(data, newest.type).temperature for data in recorded] == [
        *range(9),
        *range(10, 20),
    ]
    assert read_accounts(tmp_path / "bag")[newest.full_name]["missing"] == 1
    assert load_bag(tmp_path / "bag").lost == {t.full_name: int(t is newest) for t in topics.ALL}


def test_a_command_is_one_file_and_its_name(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "newest.py").write_text("import click\n\n@click.command()\ndef newest(): ...\n")
    monkeypatch.setattr(room_of_commands, "__path__", [*room_of_commands.__path__, str(tmp_path)])
    monkeypatch.setitem(COMMANDS, "newest", "newest")
    command = cli.get_command(click.Context(cli), "newest")
    sys.modules.pop(f"{room_of_commands.__name__}.newest")
    assert command is not None
    assert command.name == "newest"
