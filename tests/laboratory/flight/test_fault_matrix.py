"""Every kind of fault, with the reaction that is promised in docs/explanation/fault_handling.md.

Faults that do not disturb one another share a flight, each in a stretch of its own. How often a
fault by chance happens is known beforehand, so counters are compared exactly. The flights are those
of the graph, by the same classes, message by message in this process; a graph flies the one in
which nodes wait for one another, for what its nodes report of it.
"""

from __future__ import annotations

import json
import re
from collections import Counter
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import planned, space_robot_here

from space_robot.flight.flight_messages import MessageLoop
from space_robot.flight.simulate import simulate
from space_robot.scenario.faults import KINDS
from space_robot_control.controller.tick import MODES
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule, ScheduledFault
from space_robot_sim.plant.settings import PLANT_KINDS

PERIOD = 0.0005
SEED = 7

FLIGHTS = {
    name: text.split()
    for name, text in {
        "bad messages": "nan_state@0.1-0.2:0.05 inf_state@0.2-0.3:0.05 "
        "scaled_quaternion@0.3-0.4:0.05 stamp_back@0.4-0.45:0.1 stamp_jump@0.5-0.55:0.1 "
        "nan_command@0.6-0.7:0.05 inf_command@0.7-0.8:0.05",
        "bad links": "drop_state@0.05-0.1:0.1 repeat_state@0.1-0.15:0.1 drop_command@0.2-0.25:0.1 "
        "repeat_command@0.3-0.35:0.1 delay_state@0.4-0.45:2 jitter_state@0.5-0.55:3 "
        "delay_command@0.6-0.65:2 jitter_command@0.7-0.75:3 noise_gyro@0.8-0.85:1e-6",
        "bad sensors": "noise_attitude@0.05-0.1:1e-6 noise_gyro@0.15-0.2:1e-6 "
        "noise_joint_position@0.25-0.3:1e-6 noise_joint_velocity@0.35-0.4:1e-6 "
        "quantise_attitude@0.45-0.5:1e-5 quantise_gyro@0.55-0.6:1e-6 "
        "quantise_joint_position@0.65-0.7:1e-5 quantise_joint_velocity@0.75-0.8:1e-6 "
        "gyro_bias@0.81-0.83:base_x=1e-6 tracker_blind@0.84-0.85 "
        "encoder_stuck@0.86-0.865:3 noise_magnetometer@0.87-0.88:1e-6 "
        "magnetometer_bias@0.89-0.9:base_y=1e-6",
        "bad actuators": "saturate_base@0.1-0.2:0.001 saturate_joints@0.3-0.4:0.01 "
        "stuck_joint@0.6-0.9:3=15 drive_scale@0.42-0.45:all=0.9 "
        "drive_bias@0.46-0.49:base_x=0.01 torque_scale@0.5-0.53:all=1.001 "
        "torque_bias@0.54-0.57:base_x=0.001 torque_scale@0.45-0.5:all=0.99 "
        "torque_bias@0.52-0.57:joint2=0.01 drive_scale@0.91-0.94:joints=1.02 "
        "drive_bias@0.95-0.98:base_x=0.01",
        "bad hardware": "thruster_stuck_on@0.1-0.2:3 wheel_fail@0.3-0.6:2 "
        "thruster_stuck_off@0.7-0.9:thrusters",
        "long silences": "scaled_quaternion@0.1-0.25 drop_command@0.4-0.55 drop_state@0.7-0.85",
    }.items()
}
"""Flights of a second by their name; the silences last beyond `HOLD_TICKS`."""
HOLD_TICKS = 100
BAD_QUATERNION = "quaternion not unit"
NO_COMMAND = "safe: no good command, the torque is zero"


@dataclass
class Seen:
    """What a flight left behind."""

    log: FlightLog
    counts: dict[str, Counter[str]]
    """What plant and controller did not use, by reason."""
    modes: dict[str, list[tuple[int, str]]]
    """Modes of plant and controller, each with its first tick."""
    expected: dict[str, int]
    """How often each kind of fault happens."""

    def tells(self, node: str, what: str, at_s: float) -> bool:
        """Tell if a node's mode has become this at a time."""
        return any(
            mode == what and abs(k * PERIOD - at_s) <= PERIOD for k, mode in self.modes[node]
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


@cache
def seen(name: str) -> Seen:
    """Fly, and note what the nodes of a graph would report of plant and controller."""
    hold = {"hold_ticks": HOLD_TICKS}
    flight = planned(
        duration=1.0,
        seed=SEED,
        actuators="wheels_and_thrusters" if name == "bad hardware" else "ideal",
        faults=FLIGHTS[name],
        parameters={"plant": hold, "controller": hold},
    )
    modes: dict[str, list[tuple[int, str]]] = {"plant": [(0, "")], "controller": [(0, "")]}
    counts = {"plant": Counter[str](), "controller": Counter[str]()}

    class Watched(MessageLoop):
        def fly_tick(self) -> None:
            tick = flight.plant.tick
            super().fly_tick()
            supervisor = self._responder.supervisor
            counts.update(plant=self._guard.refused, controller=supervisor.rejected)
            safe = f"{MODES[supervisor.mode]}: {supervisor.reason}"
            for node, mode in (
                ("controller", safe.removesuffix(": ")),
                ("plant", NO_COMMAND if self._guard.is_safe else "nominal"),
            ):
                if modes[node][-1][1] != mode:
                    modes[node].append((tick, mode))

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("space_robot.flight.simulate.MessageLoop", Watched)
        log = simulate(flight)
    schedule = Schedule(parse_faults(FLIGHTS[name], PLANT_KINDS), SEED, PERIOD, flight.plant.names)
    expected = {
        fault.kind.name: sum(
            fault.happens_at(tick) and matters(fault, tick) for tick in range(2000)
        )
        for fault in schedule.faults
    }
    return Seen(log, counts, modes, expected)


Check = Callable[[Seen], bool]


def tracks(start_s: float, stop_s: float, error: float) -> Check:
    return lambda seen: seen.error(start_s, stop_s) < error


def no_torque(start_s: float, stop_s: float) -> Check:
    """Once a command has been held for its time, in a silence from ``start_s`` on."""
    return lambda seen: not seen.torque(start_s + HOLD_TICKS * PERIOD + 0.005, stop_s).any()


def counts(node: str, key: str, *kinds: str) -> Check:
    """A counter has exactly what was injected."""
    return lambda seen: (
        seen.counts[node][key] == sum(seen.expected[kind] for kind in kinds) > len(kinds)
    )


def safe(node: str, mode: str, start_s: float, stop_s: float) -> Check:
    """Safe once a silence has lasted beyond the hold, and nominal at its end."""
    return lambda seen: (
        seen.tells(node, mode, start_s + HOLD_TICKS * PERIOD)
        and seen.tells(node, "nominal", stop_s)
    )


TRACKS = {
    # the arm stays on its way, to so many rad, for it repeats, holds, or estimates from the echo
    1e-5: "nan_state inf_state stamp_back stamp_jump nan_command inf_command drop_state "
    "repeat_state drop_command",
    1e-4: "delay_state jitter_state delay_command jitter_command",
    1e-3: "noise_attitude noise_gyro noise_joint_position noise_joint_velocity quantise_attitude "
    "quantise_gyro quantise_joint_position quantise_joint_velocity gyro_bias tracker_blind",
    1e-2: "encoder_stuck drive_scale drive_bias torque_scale torque_bias wheel_fail "
    "thruster_stuck_on",
    0.5: "stuck_joint",
}
SHOWN: list[tuple[str, str, Check]] = [
    # fault, reaction, how it shows
    ("nan_state", "not used", counts("controller", "state not finite", "nan_state", "inf_state")),
    ("scaled_quaternion", "not used", counts("controller", BAD_QUATERNION, "scaled_quaternion")),
    ("nan_command", "refused", counts("plant", "not finite", "nan_command", "inf_command")),
    ("stamp_jump", "no answer", lambda seen: bool(seen.log.filled)),
    (
        "repeat_command",
        "refused as old",
        lambda seen: seen.counts["plant"]["stamp"] >= seen.expected["repeat_command"] > 0,
    ),
    (
        "tracker_blind",
        "the last attitude held",
        lambda seen: not np.diff(seen.log.as_measured().quaternion[1680:1700], axis=0).any(),
    ),
    (
        "saturate_base",
        "clipped, echoed",
        lambda seen: bool(np.abs(seen.torque(0.1, 0.2)[:, :3]).max() == 0.001),
    ),
    (
        "saturate_joints",
        "clipped",
        lambda seen: bool(np.abs(seen.torque(0.3, 0.4)[:, 3:]).max() == 0.01),
    ),
    (
        "wheel_fail",
        "a dead motor",
        lambda seen: not seen.log.wheel_torques[stretch(0.3, 0.6), 1].any(),
    ),
    (
        "thruster_stuck_on",
        "it burns",
        lambda seen: bool(np.all(seen.log.thrusts[stretch(0.1, 0.2), 2] == 0.9)),
    ),
    ("thruster_stuck_off", "no thrust", lambda s: not s.log.thrusts[stretch(0.7, 0.9)].any()),
]
SILENCES: list[tuple[str, str, Check]] = [
    ("scaled_quaternion", "safe", safe("controller", f"safe: {BAD_QUATERNION}", 0.1, 0.25)),
    ("scaled_quaternion", "no torque", no_torque(0.1, 0.25)),
    ("drop_command", "safe", safe("plant", NO_COMMAND, 0.4, 0.55)),
    ("drop_command", "no torque", no_torque(0.4, 0.55)),
    ("drop_state", "none yet", lambda s: not s.log.applied_torque[round(0.85 / PERIOD)].any()),
]


def rows() -> Iterator[Any]:
    """Every fault of a flight with its reactions."""
    limits = {kind: limit for limit, kinds in TRACKS.items() for kind in kinds.split()}
    for flight, texts in FLIGHTS.items():
        if flight == "long silences":
            continue
        for text in texts:
            kind, start, stop = re.findall(r"^(\w+)@([0-9.]+)-([0-9.]+)", text)[0]
            if kind in limits:
                check = tracks(float(start), float(stop), limits[kind])
                yield pytest.param(flight, check, id=f"{text}: tracks")
            for name, reaction, check in SHOWN:
                if name == kind:
                    yield pytest.param(flight, check, id=f"{text}: {reaction}")
    for kind, reaction, check in SILENCES:
        yield pytest.param("long silences", check, id=f"{kind}: {reaction}")


@pytest.mark.parametrize(("flight", "check"), list(rows()))
def test_reaction(flight: str, check: Check) -> None:
    this = seen(flight)
    assert check(this), (this.expected, this.counts, this.modes)
    assert this.log.ticks == 2000
    assert np.isfinite(this.log.applied_torque).all()


def test_every_kind_of_the_plant_is_flown() -> None:
    flown = {text.partition("@")[0] for texts in FLIGHTS.values() for text in texts}
    assert flown == set(PLANT_KINDS) < set(KINDS)


@pytest.mark.parametrize("flight", FLIGHTS)
def test_the_flight_recovers(flight: str) -> None:
    """Whatever has happened, the arm is where it should be when the faults are over."""
    this = seen(flight)
    begin, end = this.error(0.9, 0.95), this.error(0.99, 1.0)
    assert end < 2e-3 or end < begin


@pytest.mark.ros
def test_nodes_tell_of_their_modes_and_of_what_they_did_not_use(tmp_path: Path) -> None:
    """With the time of the tick."""
    pytest.importorskip("rclpy")
    words = [word for text in FLIGHTS["long silences"] for word in ("--fault", text)]
    for node in ("plant", "controller"):
        words += ["--set", f"{node}.hold_ticks={HOLD_TICKS}"]
    words += ["--duration", "1", "--seed", str(SEED), "--bag", str(tmp_path / "bag"), "--json"]
    ended = space_robot_here("fly", *words)
    assert ended.returncode == 0, ended.stderr
    graph, here = json.loads(ended.stdout)["graph"], seen("long silences")
    told = [(e["node"], e["what"], e["simulated_s"]) for e in graph["events"]]
    for node, modes in here.modes.items():
        assert len(modes) > 3
        for tick, mode in modes[2:]:
            if mode.startswith(("safe", "nominal")):
                times = [s for name, what, s in told if (name, what) == (f"{node}_node", mode)]
                assert np.abs(np.array(times) - tick * PERIOD).min() <= PERIOD, (mode, tick, told)
    rejected = int(graph["nodes"]["controller_node"][f"rejected: {BAD_QUATERNION}"])
    assert rejected == here.counts["controller"][BAD_QUATERNION] > 100
