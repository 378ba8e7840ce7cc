"""Recorded flights played to a live controller node: bit-equal, or the difference is found."""

from __future__ import annotations

import csv
import json
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bags import entries_of, rosbags_bag
from command import Run
from flights import planned, space_robot_here

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.outcome import Replay, ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command
from space_robot_msgs_py.wire.codecs import CommandCodec

pytest.importorskip("rclpy")
TICKS = 300
FLIGHT = planned()


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The bag of a short flight in process; each set of options flies once."""
    flown: dict[str, Path] = {}

    def fly(**options: object) -> Path:
        key = repr(options)
        if key not in flown:
            flown[key] = tmp_path_factory.mktemp("recorded") / "bag"
            plan = FlightPlan.model_validate({"duration": TICKS * 0.0005, **options})
            simulate(Flight(resolve(plan)), flown[key])
        return flown[key]

    return fly


@pytest.fixture
def play(domain: int) -> Callable[..., Replay]:
    """Replay in a ROS domain of the test's own."""

    def run(bag: Path, **options: object) -> Replay:
        return replay(ReplayOptions(bag, domain=domain, **options))  # type: ignore[arg-type]

    return run


def altered(bag: Path, copy: Path, change: Callable[[str, int, bytes], bytes | None]) -> Path:
    """A copy of a bag in which ``change`` has seen every message: topic, number, bytes."""
    flight = json.loads(open_bag(bag).custom_data()["space_robot.flight"])
    recorder = BagRecorder(copy, flight, FLIGHT.timebase)
    counts = dict.fromkeys(topics.BY_NAME, -1)
    for name, data in open_bag(bag).messages(*topics.ALL):
        counts[name] += 1
        if (changed := change(name, counts[name], data)) is not None:
            recorder.record(topics.BY_NAME[name], changed)
    recorder.close()
    return copy


def test_swaps_to_every_law_give_the_same_bits_again(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    first, *others = sorted(laws())
    swaps = [f"{0.01 * (k + 1):g}:{law}" for k, law in enumerate(others)]
    done = play(recorded(controller=first, swaps=swaps, case="3"))
    report = done.report()
    assert (report["compared"], report["equal"]) == (TICKS, TICKS), report["first_difference"]
    assert report["identical"]
    assert done.has_passed


def test_a_changed_gain_is_found_with_exit_code_1(recorded: Callable[..., Path]) -> None:
    gain = "controller.tde_stc.k_1=[40.0]"
    result = space_robot_here("replay", str(recorded()), "--set", gain, "--json")
    assert result.returncode == 1
    first = json.loads(result.stdout)["first_difference"]
    assert first["tick"] == 1  # at rest there is no error for a gain to act on
    assert {field["field"][:7] for field in first["fields"]} == {"effort["}
    for field in first["fields"]:
        assert field["recorded"] != field["replayed"]
        assert field["difference"] == field["replayed"] - field["recorded"]
    assert "differ from tick 1 (t = 0.0005 s) on" in result.stderr.splitlines()[-1]


def test_another_law_answers_a_bag_of_ros2_bag_record_and_is_not_judged(
    recorded: Callable[..., Path], tmp_path: Path
) -> None:
    """It has no description: what flew is what /controller/law says."""
    bag = rosbags_bag(tmp_path / "bag", entries_of(recorded()), lambda writer: None)
    table, plot = tmp_path / "torques.csv", tmp_path / "torques.png"
    written = ("--csv", str(table), "--plot", str(plot))
    result = space_robot_here("replay", str(bag), "--controller", "ctc", *written)
    assert result.returncode == 0, result.stderr
    assert "open loop" in result.stdout
    rows = list(csv.DictReader(table.open()))
    assert [int(row["tick"]) for row in rows] == list(range(TICKS))
    torque = {
        which: np.array([float(row[f"joint1_{which}"]) for row in rows])
        for which in ("recorded", "replayed")
    }
    assert 0.0 < np.abs(torque["replayed"] - torque["recorded"]).max() < 1.0
    assert plot.stat().st_size > 10_000
    assert plot.with_suffix(".svg").exists()


def test_altered_and_lost_commands_are_found_exactly(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    codec = CommandCodec(FLIGHT.robot.axis_names, FLIGHT.timebase)

    def alter(name: str, number: int, data: bytes) -> bytes | None:
        if name != "/command" or number not in (7, 8, 123):
            return data
        command = Command(-1, np.zeros(9))
        codec.decode(data, command)
        command.torque[4] = np.nextafter(command.torque[4], np.inf)
        return codec.encode(command) if number == 123 else None

    done = play(altered(recorded(), tmp_path / "bag", alter), end_s=0.1)
    assert not done.has_passed
    assert done.comparison.unrecorded.tolist() == [7, 8]
    assert done.comparison.ticks.tolist() == [k for k in range(200) if k not in (7, 8)]
    assert done.comparison.ticks[~done.comparison.equal].tolist() == [123]
    found = done.comparison.first_difference()
    assert found is not None
    assert (found[0], [d.field for d in found[1]]) == (123, ["effort[joint2]"])


def test_without_any_commands_a_flight_is_only_shown(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    none = altered(recorded(), tmp_path / "none", lambda name, k, x: x if name[1] != "c" else None)
    done = play(none, rate=1.0)
    assert done.has_passed
    assert not done.is_judged
    assert done.report()["played"] == TICKS


def test_a_part_is_compared_by_itself(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    """A law without memory is equal again once it has taken over from the applied torque."""
    part = play(recorded(controller="ctc"), start_s=0.05, end_s=0.15)
    assert part.comparison.ticks.tolist() == list(range(100, 300))
    assert part.comparison.equal[41:].all()  # the transfer lasts 20 ms
    assert not part.comparison.equal[1]


def test_a_damaged_bag_is_compared_stretch_by_stretch_and_not_passed(
    recorded: Callable[..., Path], tmp_path: Path
) -> None:
    """Before the gap every bit is equal; after it from when CTC has taken over, 20 ms later."""
    bag = tmp_path / "bag"
    shutil.copytree(recorded(controller="ctc", duration=0.45), bag)
    file = bag / "bag_0.mcap"
    content = bytearray(file.read_bytes())
    content[len(content) // 2] ^= 0x10
    file.write_bytes(content[: int(0.95 * len(content))])
    result, log = space_robot_here("replay", str(bag), "--json"), read_flight(bag)
    report = json.loads(result.stdout)
    before, after = report["stretches"]
    edges = np.flatnonzero(np.diff(log.whole.astype(int)))
    for s, tick in ((before["to_s"], edges[0]), (after["from_s"], edges[1] + 1)):
        assert s == pytest.approx(0.0005 * tick, abs=0.001)  # a tick's command may be lost alone
    assert (before["from_s"], before["equal"]) == (0.0, before["compared"])
    assert after["equal"] == after["compared"] - 40
    assert not report["differs"]
    assert report["first_gap_s"] == pytest.approx(0.0005 * (edges[0] + 1))
    assert tuple(report["damage"]) == log.damage
    assert report["unfinished"] == log.unfinished != ""
    assert (report["passed"], report["whole"], result.returncode) == (False, False, 1)


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--start", "5"), "no states in the part to be replayed"),
        (("--start", "2", "--end", "1"), "--end 1 is not after --start 2"),
        (("--set", "plant.hold_ticks=3"), "only the controller"),
        (("--remap", "/a:=/b"), "unknown topic '/b'"),
        (("--controller", "pid"), "unknown controller 'pid'"),
    ],
)
def test_bad_input_is_one_line_and_exit_code_2(
    recorded: Callable[..., Path], space_robot: Run, options: tuple[str, ...], said: str
) -> None:
    code, _, err = space_robot("replay", recorded(), *options)
    assert code == 2
    assert said in err


def test_a_bag_without_its_robot_is_refused_in_one_line(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    flown = recorded(robot="seven_joint")
    bag = rosbags_bag(tmp_path / "bag", entries_of(flown), lambda writer: None)
    with pytest.raises(InputError, match="which robot was flown, with 7 joints: name it with"):
        play(bag)
