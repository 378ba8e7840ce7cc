"""Every kind of fault on the real graph, with the reaction that docs/fault_handling.md promises.

Faults that do not disturb one another share a flight, each in a stretch of its own. How often a
fault by chance happens is known beforehand, so counters are compared exactly.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
from flights import Flown

from space_robot_msgs_py.bag import read_flight
from space_robot_msgs_py.fault import KINDS, PLANT_KINDS, parse_faults
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_sim.faults.schedule import Schedule

pytest.importorskip("rclpy")

PERIOD = 0.0005
SEED = 7
Fly = Callable[..., Flown]

FLIGHTS: dict[str, tuple[str, ...]] = {
    "bad states": (
        "nan_state@0.1-0.2:0.05", "inf_state@0.25-0.35:0.05", "scaled_quaternion@0.4-0.5:0.05",
        "stamp_back@0.55-0.6:0.1", "stamp_jump@0.65-0.7:0.1",
    ),
    "lossy links": (
        "drop_state@0.1-0.2:0.05", "repeat_state@0.25-0.35:0.05", "drop_command@0.4-0.5:0.05",
        "repeat_command@0.55-0.65:0.1",
    ),
    "late links": (
        "delay_state@0.1-0.2:2", "jitter_state@0.3-0.4:3", "delay_command@0.5-0.6:2",
        "jitter_command@0.7-0.8:3",
    ),
    "bad commands": ("nan_command@0.1-0.2:0.05", "inf_command@0.25-0.35:0.05"),
    "noisy sensors": (
        "noise_attitude@0.1-0.2:1e-6", "noise_rate@0.3-0.4:1e-6", "noise_position@0.5-0.6:1e-6",
        "noise_velocity@0.7-0.8:1e-6",
    ),
    "coarse sensors": (
        "quantise_attitude@0.1-0.2:1e-5", "quantise_rate@0.3-0.4:1e-6",
        "quantise_position@0.5-0.6:1e-5", "quantise_velocity@0.7-0.8:1e-6",
    ),
    "weak actuators": (
        "saturate_base@0.1-0.2:0.001", "saturate_joints@0.3-0.4:0.01", "stuck_joint@0.6-0.9:3=15",
    ),
    "blind": ("nan_state@0.1-0.3",),
    "deaf": ("drop_command@0.1-0.3",),
    "cut off": ("drop_state@0.1-0.3",),
}  # fmt: skip
"""Flights of a second by their name; ``blind`` and so on last beyond `HOLD_TICKS`."""
HOLD_TICKS = 100
OPTIONS = (
    "--duration", "1", "--seed", str(SEED), "--set", f"plant.hold_ticks={HOLD_TICKS}",
    "--set", f"controller.hold_ticks={HOLD_TICKS}",
)  # fmt: skip


@dataclass
class Seen:
    """What a flight left behind."""

    graph: dict[str, Any]
    log: FlightLog
    expected: dict[str, int]
    """How often each kind of fault happens."""

    def count(self, node: str, key: str) -> int:
        """A counter of a node's last diagnostics; 0 where it is not told."""
        return int(self.graph["nodes"][f"{node}_node"].get(key, 0))

    def modes(self, node: str) -> list[str]:
        """The node's modes that were worth an event."""
        return [event["what"] for event in self.graph["events"] if event["node"] == f"{node}_node"]

    def error(self, start_s: float, stop_s: float) -> float:
        """Largest joint error in a stretch, rad."""
        k = slice(round(start_s / PERIOD), round(stop_s / PERIOD))
        desired = self.log.reference_joints[k, 0]
        return float(np.abs(desired - self.log.joint_positions[k]).max())

    def torque(self, start_s: float, stop_s: float) -> np.ndarray:
        """Applied torque in a stretch."""
        return self.log.applied_torque[round(start_s / PERIOD) + 1 : round(stop_s / PERIOD)]


@pytest.fixture(scope="module")
def seen(fly: Fly) -> Callable[[str], Seen]:
    def get(name: str) -> Seen:
        texts = FLIGHTS[name]
        flown = fly(*OPTIONS, *(word for text in texts for word in ("--fault", text)))
        schedule = Schedule(parse_faults(texts, PLANT_KINDS), SEED, PERIOD)
        expected = {
            fault.kind: sum(fault.happens_at(tick) for tick in range(2000))
            for fault in schedule.faults
        }
        return Seen(flown.report["graph"], read_flight(flown.bag), expected)

    return get


Check = Callable[[Seen], bool]
MATRIX: list[tuple[str, str, str, Check]] = [
    # fault, flight, reaction, how it shows
    ("nan_state", "bad states", "not used, counted", lambda s: s.count(
        "controller", "rejected: not finite") == s.expected["nan_state"] + s.expected["inf_state"]),
    ("inf_state", "bad states", "last torque repeated", lambda s: s.error(0.25, 0.35) < 1e-5),
    ("scaled_quaternion", "bad states", "not used, counted", lambda s: s.count(
        "controller", "rejected: not unit") == s.expected["scaled_quaternion"] > 0),
    ("stamp_back", "bad states", "not used", lambda s: s.error(0.55, 0.6) < 1e-5),
    ("stamp_jump", "bad states", "not used, counted", lambda s: s.count(
        "controller", "rejected: stamp") >= s.expected["stamp_jump"] > 0),
    ("drop_state", "lossy links", "unanswered, command held", lambda s: s.count(
        "plant", "unanswered_ticks") == s.expected["drop_state"] + s.expected["drop_command"]),
    ("repeat_state", "lossy links", "answered once", lambda s: s.error(0.25, 0.35) < 1e-5),
    ("drop_command", "lossy links", "command held", lambda s: s.error(0.4, 0.5) < 1e-5),
    ("repeat_command", "lossy links", "refused as old", lambda s: s.count(
        "plant", "refused: stamp") >= s.expected["repeat_command"] > 0),
    ("delay_state", "late links", "estimate from the echo", lambda s: s.error(0.1, 0.2) < 1e-4),
    ("jitter_state", "late links", "estimate from the echo", lambda s: s.error(0.3, 0.4) < 1e-4),
    ("delay_command", "late links", "estimate from the echo", lambda s: s.error(0.5, 0.6) < 1e-4),
    ("jitter_command", "late links", "older ones refused", lambda s: s.error(0.7, 0.8) < 1e-4),
    ("nan_command", "bad commands", "refused, counted", lambda s: s.count(
        "plant", "refused: not finite") == s.expected["nan_command"] + s.expected["inf_command"]),
    ("inf_command", "bad commands", "last good held", lambda s: s.error(0.25, 0.35) < 1e-5),
    ("noise_attitude", "noisy sensors", "flown through", lambda s: s.error(0.1, 0.2) < 1e-3),
    ("noise_rate", "noisy sensors", "flown through", lambda s: s.error(0.3, 0.4) < 1e-3),
    ("noise_position", "noisy sensors", "flown through", lambda s: s.error(0.5, 0.6) < 1e-3),
    ("noise_velocity", "noisy sensors", "flown through", lambda s: s.error(0.7, 0.8) < 1e-3),
    ("quantise_attitude", "coarse sensors", "flown through", lambda s: s.error(0.1, 0.2) < 1e-3),
    ("quantise_rate", "coarse sensors", "flown through", lambda s: s.error(0.3, 0.4) < 1e-3),
    ("quantise_position", "coarse sensors", "flown through", lambda s: s.error(0.5, 0.6) < 1e-3),
    ("quantise_velocity", "coarse sensors", "flown through", lambda s: s.error(0.7, 0.8) < 1e-3),
    ("saturate_base", "weak actuators", "clipped, echoed", lambda s: bool(
        np.abs(s.torque(0.1, 0.2)[:, :3]).max() == 0.001)),
    ("saturate_joints", "weak actuators", "clipped, counted", lambda s: bool(
        np.abs(s.torque(0.3, 0.4)[:, 3:]).max() == 0.01)
        and s.count("plant", "saturated_ticks") > 100),
    ("stuck_joint", "weak actuators", "the joint stands, no NaN", lambda s: bool(
        np.isfinite(s.log.applied_torque).all())),
    ("nan_state", "blind", "holding, then safe, then back", lambda s: [
        mode.partition(":")[0] for mode in s.modes("controller")] == ["holding", "safe", "nominal"]
        or s.modes("controller")[-2:] == ["safe: the state is not finite", "nominal"]),
    ("nan_state", "blind", "no torque after hold_ticks", lambda s: bool(
        np.all(s.torque(0.1 + HOLD_TICKS * PERIOD + 0.01, 0.3) == 0.0))),
    ("drop_command", "deaf", "no torque after hold_ticks", lambda s: bool(
        np.all(s.torque(0.1 + HOLD_TICKS * PERIOD + 0.01, 0.3) == 0.0))),
    ("drop_command", "deaf", "safe, then back", lambda s: s.modes("plant")[-2:] == [
        "safe: no good command, the torque is zero", "nominal"]),
    ("drop_state", "cut off", "no torque after hold_ticks", lambda s: bool(
        np.all(s.log.applied_torque[round(0.3 / PERIOD) + 1] == 0.0))),
]  # fmt: skip


@pytest.mark.parametrize(
    ("fault", "flight", "reaction", "check"),
    [pytest.param(*row, id=f"{row[0]}, {row[1]}: {row[2]}") for row in MATRIX],
)
def test_reaction(
    seen: Callable[[str], Seen], fault: str, flight: str, reaction: str, check: Check
) -> None:
    this = seen(flight)
    assert check(this), (this.expected, this.graph)
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
    first = seen("lossy links").log
    words = [word for text in FLIGHTS["lossy links"] for word in ("--fault", text)]
    again = read_flight(fly(*OPTIONS, *words, "--controller", "tde_stc").bag)
    for column in ("quaternion", "joint_positions", "joint_velocities", "applied_torque"):
        np.testing.assert_array_equal(getattr(again, column), getattr(first, column), column)
