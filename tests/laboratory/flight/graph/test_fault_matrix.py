"""Every kind of fault on the real graph, with the reaction that is promised

in docs/explanation/fault_handling.md.

Faults that do not disturb one another share a flight, each in a stretch of its own. How often a
fault by chance happens is known beforehand, so counters are compared exactly. All flights but one
are composed, which takes half the processor's time; one of those is flown again by four processes.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import Flown
from paths import CONFIG

from space_robot.scenario.faults import KINDS
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule, ScheduledFault
from space_robot_sim.plant.faults import PLANT_KINDS

pytest.importorskip("rclpy")

PERIOD = 0.0005
SEED = 7
Fly = Callable[..., Flown]

FLIGHTS: dict[str, tuple[str, ...]] = {
    "bad messages": (
        "nan_state@0.1-0.2:0.05",
        "inf_state@0.2-0.3:0.05",
        "scaled_quaternion@0.3-0.4:0.05",
        "stamp_back@0.4-0.45:0.1",
        "stamp_jump@0.5-0.55:0.1",
        "nan_command@0.6-0.7:0.05",
        "inf_command@0.7-0.8:0.05",
    ),
    "bad links": (
        "drop_state@0.05-0.1:0.1",
        "repeat_state@0.1-0.15:0.1",
        "drop_command@0.2-0.25:0.1",
        "repeat_command@0.3-0.35:0.1",
        "delay_state@0.4-0.45:2",
        "jitter_state@0.5-0.55:3",
        "delay_command@0.6-0.65:2",
        "jitter_command@0.7-0.75:3",
        "noise_gyro@0.8-0.85:1e-6",
    ),
    "bad sensors": (
        "noise_attitude@0.05-0.1:1e-6",
        "noise_gyro@0.15-0.2:1e-6",
        "noise_joint_position@0.25-0.3:1e-6",
        "noise_joint_velocity@0.35-0.4:1e-6",
        "quantise_attitude@0.45-0.5:1e-5",
        "quantise_gyro@0.55-0.6:1e-6",
        "quantise_joint_position@0.65-0.7:1e-5",
        "quantise_joint_velocity@0.75-0.8:1e-6",
        "gyro_bias@0.81-0.83:base_x=1e-6",
        "tracker_blind@0.84-0.85",
        "encoder_stuck@0.86-0.865:3",
    ),
    "bad actuators": (
        "saturate_base@0.1-0.2:0.001",
        "saturate_joints@0.3-0.4:0.01",
        "stuck_joint@0.6-0.9:3=15",
        "drive_scale@0.42-0.45:all=0.9",
        "drive_bias@0.46-0.49:base_x=0.01",
        "torque_scale@0.5-0.53:all=1.001",
        "torque_bias@0.54-0.57:base_x=0.001",
        "torque_scale@0.45-0.5:all=0.99",
        "torque_bias@0.52-0.57:joint2=0.01",
        "drive_scale@0.91-0.94:joints=1.02",
        "drive_bias@0.95-0.98:base_x=0.01",
    ),
    "bad hardware": (
        "thruster_stuck_on@0.1-0.2:3",
        "wheel_fail@0.3-0.6:2",
        "thruster_stuck_off@0.7-0.9:thrusters",
    ),
    "long silences": ("scaled_quaternion@0.1-0.25", "drop_command@0.4-0.55", "drop_state@0.7-0.85"),
}
"""Flights of a second by their name; the silences last beyond `HOLD_TICKS`."""
HOLD_TICKS = 100
OPTIONS = (
    "--duration",
    "1",
    "--seed",
    str(SEED),
    "--set",
    f"plant.hold_ticks={HOLD_TICKS}",
    "--set",
    f"controller.hold_ticks={HOLD_TICKS}",
)
ACTUATORS = {"bad hardware": "wheels_and_thrusters"}
"""Of the flights that need others than ideal ones."""
IN_PROCESSES = {"long silences"}
"""Flights of four processes from the first: here nodes wait for one another."""
SENT_AND_RECEIVED = (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND)


@dataclass
class Seen:
    """What a flight left behind."""

    graph: dict[str, Any]
    bag: Path
    log: FlightLog
    expected: dict[str, int]
    """How often each kind of fault happens."""

    def count(self, node: str, key: str) -> int:
        """A counter of a node's last diagnostics; 0 where it is not told."""
        return int(self.graph["nodes"][f"{node}_node"].get(key, 0))

    def modes(self, node: str) -> list[str]:
        """The node's modes that were worth an event."""
        return [event["what"] for event in self.graph["events"] if event["node"] == f"{node}_node"]

    def tells(self, node: str, what: str, at_s: float) -> bool:
        """Tell if an event is among those of its node, with its tick's time."""
        return any(
            event["node"] == f"{node}_node"
            and event["what"] == what
            and event["simulated_s"] == pytest.approx(at_s, abs=PERIOD)
            for event in self.graph["events"]
        )

    def error(self, start_s: float, stop_s: float) -> float:
        """Largest joint error in a stretch, rad."""
        k = slice(round(start_s / PERIOD), round(stop_s / PERIOD))
        desired = self.log.reference_joints[k, 0]
        return float(np.abs(desired - self.log.joint_positions[k]).max())

    def torque(self, start_s: float, stop_s: float) -> np.ndarray:
        """Applied torque in a stretch."""
        return self.log.applied_torque[stretch(start_s, stop_s)]


def stretch(start_s: float, stop_s: float) -> slice:
    """The rows of what was applied in a stretch: each tells of the interval before it."""
    return slice(round(start_s / PERIOD) + 1, round(stop_s / PERIOD))


def matters(fault: ScheduledFault, tick: int) -> bool:
    """Whether the controller uses what is spoilt: not the base's position and velocity."""
    place = fault.choose(tick, 25)
    return fault.kind.name not in ("nan_state", "inf_state") or 3 <= place < 7 or place >= 10


@pytest.fixture(scope="module")
def seen(fly: Fly) -> Callable[[str], Seen]:
    def get(name: str) -> Seen:
        texts = FLIGHTS[name]
        actuators = ACTUATORS.get(name, "ideal")
        words = (word for text in texts for word in ("--fault", text))
        how = () if name in IN_PROCESSES else ("--composed",)
        flown = fly(*OPTIONS, "--actuators", actuators, *words, *how)
        robot = Robot.from_yaml(CONFIG / "robots/paper.yaml")
        schedule = Schedule(
            parse_faults(texts, PLANT_KINDS),
            SEED,
            PERIOD,
            assumed_actuators(actuators, robot).robot_names(robot),
        )
        expected = {
            fault.kind.name: sum(
                fault.happens_at(tick) and matters(fault, tick) for tick in range(2000)
            )
            for fault in schedule.faults
        }
        return Seen(flown.report["graph"], flown.bag, read_flight(flown.bag), expected)

    return get


Check = Callable[[Seen], bool]


def tracks(start_s: float, stop_s: float, error: float) -> Check:
    """The arm stays on its way."""
    return lambda seen: seen.error(start_s, stop_s) < error


def no_torque(start_s: float, stop_s: float) -> Check:
    """Once a command has been held for its time, in a silence from ``start_s`` on."""
    return lambda seen: bool(
        np.all(seen.torque(start_s + HOLD_TICKS * PERIOD + 0.005, stop_s) == 0.0)
    )


def counts(node: str, key: str, *kinds: str) -> Check:
    """A counter has exactly what was injected."""
    return lambda seen: (
        seen.count(node, key) == sum(seen.expected[kind] for kind in kinds) > len(kinds)
    )


MATRIX: list[tuple[str, str, str, Check]] = [
    # fault, flight, reaction, how it shows
    (
        "nan_state",
        "bad messages",
        "not used, counted",
        counts("controller", "rejected: state not finite", "nan_state", "inf_state"),
    ),
    ("nan_state", "bad messages", "last torque repeated", tracks(0.1, 0.2, 1e-5)),
    ("inf_state", "bad messages", "last torque repeated", tracks(0.2, 0.3, 1e-5)),
    (
        "scaled_quaternion",
        "bad messages",
        "not used, counted",
        counts("controller", "rejected: quaternion not unit", "scaled_quaternion"),
    ),
    ("stamp_back", "bad messages", "not used", tracks(0.4, 0.45, 1e-5)),
    ("stamp_jump", "bad messages", "not used", tracks(0.5, 0.55, 1e-5)),
    (
        "stamp_jump",
        "bad messages",
        "counted",
        lambda seen: seen.count("controller", "rejected: stamp") > 0,
    ),
    (
        "nan_command",
        "bad messages",
        "refused, counted",
        counts("plant", "refused: not finite", "nan_command", "inf_command"),
    ),
    ("nan_command", "bad messages", "last good held", tracks(0.6, 0.7, 1e-5)),
    ("inf_command", "bad messages", "last good held", tracks(0.7, 0.8, 1e-5)),
    ("drop_state", "bad links", "command held", tracks(0.05, 0.1, 1e-5)),
    ("repeat_state", "bad links", "answered once", tracks(0.1, 0.15, 1e-5)),
    ("drop_command", "bad links", "last good held", tracks(0.2, 0.25, 1e-5)),
    (
        "repeat_command",
        "bad links",
        "refused as old, counted",
        lambda seen: seen.count("plant", "refused: stamp") >= seen.expected["repeat_command"] > 0,
    ),
    ("delay_state", "bad links", "estimate from the echo", tracks(0.4, 0.45, 1e-4)),
    ("jitter_state", "bad links", "estimate from the echo", tracks(0.5, 0.55, 1e-4)),
    ("delay_command", "bad links", "estimate from the echo", tracks(0.6, 0.65, 1e-4)),
    ("jitter_command", "bad links", "older ones refused", tracks(0.7, 0.75, 1e-4)),
    ("noise_attitude", "bad sensors", "flown through", tracks(0.05, 0.1, 1e-3)),
    ("noise_gyro", "bad sensors", "flown through", tracks(0.15, 0.2, 1e-3)),
    ("noise_joint_position", "bad sensors", "flown through", tracks(0.25, 0.3, 1e-3)),
    ("noise_joint_velocity", "bad sensors", "flown through", tracks(0.35, 0.4, 1e-3)),
    ("quantise_attitude", "bad sensors", "flown through", tracks(0.45, 0.5, 1e-3)),
    ("quantise_gyro", "bad sensors", "flown through", tracks(0.55, 0.6, 1e-3)),
    ("quantise_joint_position", "bad sensors", "flown through", tracks(0.65, 0.7, 1e-3)),
    ("quantise_joint_velocity", "bad sensors", "flown through", tracks(0.75, 0.8, 1e-3)),
    ("gyro_bias", "bad sensors", "flown through", tracks(0.81, 0.83, 1e-3)),
    ("tracker_blind", "bad sensors", "the last attitude held", tracks(0.84, 0.85, 1e-3)),
    (
        "tracker_blind",
        "bad sensors",
        "the last attitude held",
        lambda seen: not np.diff(seen.log.as_measured().quaternion[1680:1700], axis=0).any(),
    ),
    ("encoder_stuck", "bad sensors", "flown through", tracks(0.86, 0.865, 1e-2)),
    (
        "saturate_base",
        "bad actuators",
        "clipped, echoed",
        lambda seen: bool(np.abs(seen.torque(0.1, 0.2)[:, :3]).max() == 0.001),
    ),
    (
        "saturate_joints",
        "bad actuators",
        "clipped, counted",
        lambda seen: (
            bool(np.abs(seen.torque(0.3, 0.4)[:, 3:]).max() == 0.01)
            and seen.count("plant", "saturated_ticks") > 100
        ),
    ),
    ("drive_scale", "bad actuators", "flown through", tracks(0.42, 0.45, 1e-2)),
    ("drive_bias", "bad actuators", "flown through", tracks(0.46, 0.49, 1e-2)),
    ("torque_scale", "bad actuators", "flown through", tracks(0.5, 0.53, 1e-2)),
    ("torque_bias", "bad actuators", "flown through", tracks(0.54, 0.57, 1e-2)),
    ("stuck_joint", "bad actuators", "the others go on", tracks(0.6, 0.9, 0.5)),
    ("torque_scale", "bad actuators", "flown through", tracks(0.45, 0.5, 1e-2)),
    ("torque_bias", "bad actuators", "flown through", tracks(0.52, 0.57, 1e-2)),
    ("drive_scale", "bad actuators", "the estimate has it", tracks(0.91, 0.94, 1e-2)),
    ("drive_bias", "bad actuators", "the estimate has it", tracks(0.95, 0.98, 1e-2)),
    (
        "wheel_fail",
        "bad hardware",
        "a dead motor, three wheels go on",
        lambda seen: (
            not seen.log.wheel_torques[stretch(0.3, 0.6), 1].any() and seen.error(0.3, 1.0) < 1e-2
        ),
    ),
    (
        "thruster_stuck_on",
        "bad hardware",
        "it burns, wheels hold against it",
        lambda seen: (
            bool(np.all(seen.log.thrusts[stretch(0.1, 0.2), 2] == 0.9))
            and seen.error(0.1, 0.3) < 1e-2
        ),
    ),
    (
        "thruster_stuck_off",
        "bad hardware",
        "no thrust",
        lambda seen: not seen.log.thrusts[stretch(0.7, 0.9)].any(),
    ),
    (
        "scaled_quaternion",
        "long silences",
        "the controller goes safe, then back",
        lambda seen: (
            "safe: quaternion not unit" in " ".join(seen.modes("controller"))
            and seen.modes("controller")[-1] == "nominal"
        ),
    ),
    (
        "scaled_quaternion",
        "long silences",
        "told with the time of its tick",
        lambda seen: (
            seen.tells("controller", "safe: quaternion not unit", 0.1 + HOLD_TICKS * PERIOD)
            and seen.tells("controller", "nominal", 0.25)
        ),
    ),
    ("scaled_quaternion", "long silences", "no torque after hold_ticks", no_torque(0.1, 0.25)),
    (
        "drop_command",
        "long silences",
        "the plant goes safe, then back",
        lambda seen: (
            "safe: no good command, the torque is zero" in seen.modes("plant")
            and seen.modes("plant")[-1] == "nominal"
        ),
    ),
    (
        "drop_command",
        "long silences",
        "told with the time of its tick",
        lambda seen: (
            seen.tells(
                "plant", "safe: no good command, the torque is zero", 0.4 + HOLD_TICKS * PERIOD
            )
            and seen.tells("plant", "nominal", 0.55)
        ),
    ),
    ("drop_command", "long silences", "no torque after hold_ticks", no_torque(0.4, 0.55)),
    (
        "drop_state",
        "long silences",
        "no torque when states come again",
        lambda seen: bool(np.all(seen.log.applied_torque[round(0.85 / PERIOD)] == 0.0)),
    ),
]


@pytest.mark.parametrize(
    ("fault", "flight", "reaction", "check"),
    [pytest.param(*row, id=f"{row[0]}, {row[1]}: {row[2]}") for row in MATRIX],
)
def test_reaction(
    seen: Callable[[str], Seen], fault: str, flight: str, reaction: str, check: Check
) -> None:
    this = seen(flight)
    assert check(this), f"{this.expected}\n{json.dumps(this.graph, indent=1)}"
    assert this.log.ticks == 2000
    assert np.isfinite(this.log.applied_torque).all()


def test_the_matrix_has_every_kind_of_the_plant() -> None:
    assert {row[0] for row in MATRIX} == set(PLANT_KINDS)
    assert set(KINDS) > set(PLANT_KINDS)


@pytest.mark.parametrize("flight", FLIGHTS)
def test_the_flight_recovers(seen: Callable[[str], Seen], flight: str) -> None:
    """Whatever has happened, the arm is where it should be when the faults are over."""
    this = seen(flight)
    begin, end = this.error(0.9, 0.95), this.error(0.99, 1.0)
    assert end < 2e-3 or end < begin


def test_a_faulty_flight_repeats_to_the_bit(fly: Fly, seen: Callable[[str], Seen]) -> None:
    """In four processes what was flown in one: states and commands to the last byte."""
    first = seen("bad links")
    words = [word for text in FLIGHTS["bad links"] for word in ("--fault", text)]
    again = fly(*OPTIONS, *words).bag
    for topic in SENT_AND_RECEIVED:
        one, other = (
            [data for _, data in open_bag(bag).messages(topic)] for bag in (first.bag, again)
        )
        assert one == other, topic.full_name
    log = read_flight(again)
    for column in ("quaternion", "joint_positions", "joint_velocities", "applied_torque"):
        np.testing.assert_array_equal(getattr(log, column), getattr(first.log, column), column)
