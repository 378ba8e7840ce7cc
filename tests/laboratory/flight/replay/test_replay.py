"""Recorded flights played to a live controller node: bit-equal, or the difference is found."""

from __future__ import annotations

import csv
import json
import signal
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil
import pytest
from bags import entries_of, rosbags_bag
from command import Run
from driven_robots import driven_paper
from flights import Flown, forked_space_robot, space_robot_here

from space_robot.cli.replay_display import title
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.outcome import Replay, ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Command
from space_robot_msgs_py.wire.codecs import CommandCodec

pytest.importorskip("rclpy")
TICKS = 300


@pytest.fixture(scope="session")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Path]:
    """The bag of a short flight in process; each set of options flies once a session."""
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
    recorder = BagRecorder(copy, flight, Flight(resolve(FlightPlan())).timebase)
    counts = dict.fromkeys(topics.BY_NAME, -1)
    for name, data in open_bag(bag).messages(*topics.ALL):
        counts[name] += 1
        if (changed := change(name, counts[name], data)) is not None:
            recorder.record(topics.BY_NAME[name], changed)
    recorder.close()
    return copy


def test_a_plant_that_is_another_robot_in_truth_is_replayed_to_the_same_bits(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    nominal = find_robot("paper")
    report = play(
        recorded(controller="ctc", plant_robot=replace(nominal, mass=1.1 * nominal.mass))
    ).report()
    assert report["identical"], report["first_difference"]


@pytest.mark.parametrize("law", ["tde_stc", "ctc"])
def test_the_law_that_flew_commands_the_same_bits(
    recorded: Callable[..., Path], play: Callable[..., Replay], law: str
) -> None:
    done = play(recorded(controller=law, case="3"))
    report = done.report()
    assert (report["compared"], report["equal"]) == (TICKS, TICKS), report["first_difference"]
    assert report["identical"]
    assert done.has_passed


def test_a_flight_with_a_free_base_gives_the_same_bits(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    """The node that is played to learns of it from the bag."""
    done = play(recorded(actuators="none", swaps=["0.05:ctc", "0.1:tde_smc"]))
    assert done.comparison.is_identical, done.report()["first_difference"]


@pytest.mark.parametrize("orbit", ["none", "iss"])
def test_gears_and_an_orbit_give_the_same_bits(
    recorded: Callable[..., Path], play: Callable[..., Replay], orbit: str
) -> None:
    """The controller gets what the encoders on the motors' and on the links' side measured."""
    done = play(recorded(robot=Robot.from_dict(driven_paper()), orbit=orbit, case="3"))
    assert done.comparison.is_identical, done.report()["first_difference"]
    assert len(done.comparison.ticks) == TICKS


def test_swaps_are_made_again_at_their_ticks(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    """To every other law in turn; each commands the same bits from its takeover on."""
    first, *others = sorted(laws())
    swaps = [f"{0.03 * (k + 1):g}:{law}" for k, law in enumerate(others)]
    done = play(recorded(controller=first, swaps=swaps, case="3"))
    assert done.comparison.is_identical, done.report()["first_difference"]
    assert len(done.comparison.ticks) == TICKS


def test_faulty_states_are_answered_as_in_flight(
    fly: Callable[..., Flown], play: Callable[..., Replay]
) -> None:
    """Lost, late, noisy, not finite, wrongly stamped: bytes that the graph's controller got."""
    faults = [
        "noise_gyro@0:1e-5",
        "drop_state@0.05-0.15:0.2",
        "nan_state@0.1-0.2:0.2",
        "jitter_state@0.2-0.25:2",
        "stamp_back@0.25:0.1",
        "stamp_jump@0.25:0.05",
        "delay_command@0.1-0.2:2",
    ]
    words = (word for fault in faults for word in ("--fault", fault))
    flown = fly("--duration", "0.4", "--composed", *words)
    done = play(flown.bag)
    assert done.comparison.is_identical, done.report()["first_difference"]
    assert 400 < len(done.comparison.ticks) < 800


def test_a_changed_gain_is_found_with_exit_code_1(recorded: Callable[..., Path]) -> None:
    result = space_robot_here(
        "replay", str(recorded()), "--set", "controller.tde_stc.k_1=[40.0]", "--json"
    )
    assert result.returncode == 1
    first = json.loads(result.stdout)["first_difference"]
    assert first["tick"] == 1  # at rest there is no error for a gain to act on
    assert {field["field"][:7] for field in first["fields"]} == {"effort["}
    for field in first["fields"]:
        assert field["recorded"] != field["replayed"]
        assert field["difference"] == field["replayed"] - field["recorded"]
    assert "differ from tick 1 (t = 0.0005 s) on" in result.stderr.splitlines()[-1]


def test_another_law_is_shown_and_not_judged(recorded: Callable[..., Path], tmp_path: Path) -> None:
    table, plot = tmp_path / "torques.csv", tmp_path / "torques.png"
    result = space_robot_here(
        "replay", str(recorded()), "--controller", "ctc", "--csv", str(table), "--plot", str(plot)
    )
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


def test_another_law_answers_a_bag_of_ros2_bag_record(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    """It has no description: what flew is what /controller/law says."""
    bag = rosbags_bag(tmp_path / "bag", entries_of(recorded(case="3")), lambda writer: None)
    other = play(bag, controller="ctc").report()
    expected = play(recorded(case="3"), controller="ctc").report()
    assert (other["replayed"]["controller"], other["judged"]) == ("ctc", False)
    assert other["recorded"]["laws"][0]["controller"] == "tde_stc"
    assert other["axes"] == expected["axes"]
    assert title(other).endswith(": ctc, gains default, in lockstep")
    same = play(bag).report()
    assert (same["replayed"]["controller"], same["judged"], same["passed"]) == (
        "tde_stc",
        True,
        True,
    )


def test_a_bag_without_its_robot_is_refused_in_one_line(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    flown = recorded(robot="seven_joint")
    bag = rosbags_bag(tmp_path / "bag", entries_of(flown), lambda writer: None)
    with pytest.raises(InputError, match="which robot was flown, with 7 joints: name it with"):
        play(bag)
    assert play(bag, parameters={"robot": "seven_joint"}).has_passed


def test_one_altered_command_is_found_exactly(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    codec = CommandCodec(
        Flight(resolve(FlightPlan())).robot.axis_names, Flight(resolve(FlightPlan())).timebase
    )

    def alter(name: str, number: int, data: bytes) -> bytes:
        if (name, number) != ("/command", 123):
            return data
        command = Command(-1, np.zeros(9))
        codec.decode(data, command)
        command.torque[4] = np.nextafter(command.torque[4], np.inf)
        return codec.encode(command)

    done = play(altered(recorded(), tmp_path / "bag", alter), end_s=0.1)
    assert not done.has_passed
    assert done.comparison.ticks.tolist() == list(range(200))
    assert np.flatnonzero(~done.comparison.equal).tolist() == [123]
    found = done.comparison.first_difference()
    assert found is not None
    assert (found[0], [d.field for d in found[1]]) == (123, ["effort[joint2]"])


def test_lost_commands_are_missing_and_none_at_all_are_only_shown(
    recorded: Callable[..., Path], play: Callable[..., Replay], tmp_path: Path
) -> None:
    def lose(name: str, number: int, data: bytes) -> bytes | None:
        return None if name == "/command" and number in (7, 8) else data

    done = play(altered(recorded(), tmp_path / "holes", lose))
    assert not done.has_passed
    assert done.comparison.equal.all()
    assert done.comparison.unrecorded.tolist() == [7, 8]
    none = altered(recorded(), tmp_path / "none", lambda name, k, x: x if name[1] != "c" else None)
    done = play(none)
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


def test_by_the_clock_missed_ticks_are_counted(
    recorded: Callable[..., Path], play: Callable[..., Replay]
) -> None:
    done = play(recorded(), rate=0.2)
    comparison = done.comparison
    assert len(comparison.ticks) + len(comparison.unanswered) == TICKS
    assert comparison.equal[0]
    assert done.has_passed == (not len(comparison.unanswered))


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


@pytest.mark.parametrize(
    ("victim", "number", "code", "said"),
    [
        ("controller", signal.SIGKILL, 1, "controller ended by signal 9 before the replay was"),
        ("replay", signal.SIGINT, 130, "the replay was stopped"),
    ],
)
def test_a_replay_that_is_cut_short_tells_what_it_has_and_leaves_no_process(
    recorded: Callable[..., Path], victim: str, number: int, code: int, said: str
) -> None:
    """By the clock so slowly that there is time: it would take 15 s."""
    process = forked_space_robot("replay", str(recorded()), "--rate", "0.01", "--json")
    replaying, until = psutil.Process(process.pid), time.monotonic() + 60.0
    while not (nodes := controllers(replaying)):
        assert time.monotonic() < until
        time.sleep(0.05)
    time.sleep(1.0)
    (nodes[0] if victim == "controller" else replaying).send_signal(number)
    output, errors = process.communicate(timeout=60)
    assert process.returncode == code, errors
    assert said in errors
    if output:  # the playing had begun
        assert json.loads(output)["error"]
    assert not nodes[0].is_running()


def controllers(replaying: psutil.Process) -> list[psutil.Process]:
    """The controller's process, once it is there."""
    found = replaying.children(recursive=True)
    return [process for process in found if "controller_node" in name(process)]


def name(process: psutil.Process) -> str:
    try:
        return " ".join(process.cmdline())
    except psutil.Error:  # it has just ended
        return ""
