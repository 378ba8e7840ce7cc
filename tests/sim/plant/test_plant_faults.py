"""Faults of the plant, health of its actuators, and what passes to and from the controller."""

from __future__ import annotations

import math
from collections import Counter
from typing import Any

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import STATE_FIELDS, Command, RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_sim.faults.messages import MessageFaults
from space_robot_sim.plant.messages import NO_TICK, CommandGuard, PlantMessages, SentState
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.report import ActuatorHealth
from space_robot_sim.plant.settings import FaultSettings, PlantNodeSettings, PlantSettings

PERIOD = 5e-4
TORQUE = np.array([5.0, -4.0, 3.0, 20.0, -30.0, 15.0, 4.0, -3.0, 2.0])


def plant_of(robot: Robot, *faults: str, seed: int = 0, **settings: float) -> Plant:
    start = {"initial_joints_deg": [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]}
    given = {**start, "faults": list(faults), "fault_seed": seed, **settings}
    return Plant(robot, PlantSettings.model_validate(given), PERIOD)


def message_faults(robot: Robot, *texts: str, seed: int = 0) -> MessageFaults:
    settings = PlantSettings(faults=list(texts), fault_seed=seed)
    return MessageFaults(settings.schedule(RobotNames(robot.joint_names), PERIOD), robot.n)


def memory_of(plant: Plant) -> tuple[list[float], list[float]]:
    memory = plant.block[0]
    limit, friction = memory.actuators.torque_limit.limit, memory.environment.friction
    return limit.tolist(), friction.coulomb.tolist()


def test_actuators_fail_in_time_and_are_restored_exactly(paper_robot: Robot) -> None:
    """Overlapping faults too: the lower limit and the higher friction count."""
    texts = [
        "saturate_base@0.005-0.01:2",
        "saturate_base@0.0075-0.015:1",
        "saturate_joints@0.01:3",
        "stuck_joint@0.005-0.01:2=20",
        "stuck_joint@0.005-0.0075:6=0.001",
    ]
    plant = plant_of(paper_robot, *texts, joint_torque_limit=7.0)
    sound, coulomb = memory_of(plant)
    assert sound == [math.inf] * 3 + [7.0] * 6
    for tick in range(40):
        base = min(2.0 if 10 <= tick < 20 else math.inf, 1.0 if 15 <= tick < 30 else math.inf)
        joints = 3.0 if tick >= 20 else 7.0
        stuck = [coulomb[0], 20.0 if 10 <= tick < 20 else coulomb[1], *coulomb[2:]]
        assert memory_of(plant) == ([base] * 3 + [joints] * 6, stuck)
        plant.step(Command(tick, TORQUE))
        assert np.abs(plant.state.applied_torque[:3]).max() <= base
        assert np.abs(plant.state.applied_torque[3:]).max() <= joints


def test_a_fault_never_makes_an_actuator_stronger_nor_a_joint_freer(paper_robot: Robot) -> None:
    """Limits and friction that are worse than the fault's stay; 0 is the lowest limit of all."""
    texts = ["saturate_base@0.0005:2", "saturate_joints@0.0005:9", "stuck_joint@0.0005:2=1"]
    plant = plant_of(paper_robot, *texts, base_torque_limit=0.5, joint_torque_limit=7.0)
    plant.block[0].actuators.torque_limit.limit[4] = 0.0
    plant.block[0].environment.friction.coulomb[1] = 3.0
    worst = memory_of(plant)
    for tick in range(3):
        plant.step(Command(tick, TORQUE))
        assert memory_of(plant) == worst


def test_measurements_carry_the_wrong_stamp_and_the_truth_its_own(paper_robot: Robot) -> None:
    plant = plant_of(paper_robot)
    faults = message_faults(paper_robot, "stamp_jump@0", "nan_state@0")
    measured = faults.measure(plant.state)
    assert measured.tick == 1_000_000
    assert plant.tick == 0
    assert all(np.isfinite(getattr(plant.state, name)).all() for name in STATE_FIELDS)
    assert not all(np.isfinite(getattr(measured, name)).all() for name in STATE_FIELDS)


def test_a_plant_changes_when_its_parts_begin_or_cease_to_fail(paper_robot: Robot) -> None:
    """Compiled code may fly on over all ticks between; messages are not the plant's affair."""
    texts = ("stuck_joint@0.01-0.02:1=9", "saturate_base@0.02:1", "drop_state@0.005")
    plant, changes = plant_of(paper_robot, *texts), set()
    for tick in range(50):
        changes.add(plant.next_change)
        plant.step(Command(tick, 0.0 * TORQUE))
    assert changes == {20, 40, math.inf}


class Watched:
    """A plant that is asked for something, and what it tells."""

    def __init__(self, robot: Robot, actuators: str, **overrides: Any) -> None:
        settings = PlantNodeSettings.resolve({"actuators": actuators, **overrides})
        self.plant = Plant(robot, settings, PERIOD)
        self.health = ActuatorHealth(self.plant)

    def ask(self, *asked: float) -> None:
        command = np.zeros(len(self.plant.names.commanded))
        command[-len(asked) :] = asked
        self.plant.step(Command(self.plant.tick, command))


def test_wheels_tell_saturation_momentum_and_failure(paper_robot: Robot) -> None:
    faults = {"faults": ["wheel_fail@0.001:4"], "wheels.initial_speed": [314.0, -157.0, 0.0, 0.0]}
    watched = Watched(paper_robot, "small_wheels", **faults)
    share = 100.0 * 0.0796 * 314.0 / 50.0
    assert watched.health.values == {
        "momentum_percent: wheel_1": pytest.approx(share),
        "momentum_percent: wheel_2": pytest.approx(-0.5 * share),
        "momentum_percent: wheel_3": 0.0,
        "momentum_percent: wheel_4": 0.0,
    }
    for _ in range(3):
        watched.ask(0.1, 0.3, -0.19, 0.2)
    values = watched.health.values
    assert values["saturated_ticks: wheel_2"] == 3
    assert values["saturated_ticks: wheel_4"] == 2  # and dead since
    assert values["failed"] == "wheel_4"
    assert "saturated_ticks: wheel_1" not in values
    assert watched.plant.saturated_ticks == 3
    assert watched.health.saturated() == "wheel_2, wheel_4"
    assert watched.health.saturated() == ""
    watched.ask(0.3, 0.1, 0.1, 0.1)
    assert watched.health.saturated() == "wheel_1"


def test_thrusters_tell_pulses_and_propellant(paper_robot: Robot) -> None:
    overrides = {"thrusters.delay": [0.0], "faults": ["thruster_stuck_off@0:3"]}
    watched = Watched(paper_robot, "thrusters", **overrides)
    watched.ask(*[4.5, 0.0, 4.5, *np.zeros(9)])
    used = PERIOD * 4.5 / (226.1 * 9.80665)
    assert watched.health.values == {
        "pulses": 1,
        "propellant_used_kg": pytest.approx(used),
        "propellant_left_kg": pytest.approx(20.0 - used),
        "stuck_off": "thruster_3",
    }
    without_end = Watched(paper_robot, "thrusters", **{"thrusters.propellant": 0.0})
    assert "propellant_left_kg" not in without_end.health.values


AXES, HOLD = 3, 10
torques = st.lists(st.floats(width=64), min_size=AXES, max_size=AXES)
"""NaN, infinities and the largest numbers among them."""
arrivals = st.lists(
    st.tuples(
        st.integers(0, 4), st.lists(st.tuples(st.integers(-2 * HOLD, 5), torques), max_size=3)
    ),
    max_size=40,
)
"""At each step the ticks that pass, then the commands that come: stamp less now, torque."""


def offer(guard: CommandGuard, now: int, stamp: int, torque: float | list[float]) -> bool:
    guard.offered.tick = stamp
    guard.offered.torque[:] = torque
    return guard.accept(now)


@given(arrivals, st.integers(0, HOLD))
@example([(0, [(0, [np.inf, -np.inf, 0.0])])], HOLD)
@example([(0, [(0, [1.7e308] * AXES)])], HOLD)
def test_what_acts_is_the_newest_good_command_while_it_is_young(
    stream: list[tuple[int, list[tuple[int, list[float]]]]], hold_ticks: int
) -> None:
    """Against the rule in other words; every command is accepted or counted."""
    guard, now, good = CommandGuard(AXES, hold_ticks), 0, {-1: [0.0] * AXES}
    refused: Counter[str] = Counter()
    for elapsed, commands in stream:
        now += elapsed
        for delay, torque in commands:
            stamp = now + delay
            is_awaited = max(good) < stamp <= now
            is_good = is_awaited and all(np.isfinite(torque))
            assert offer(guard, now, stamp, torque) == is_good
            if is_good:
                good[stamp] = torque
            else:
                refused["not finite" if is_awaited else "stamp"] += 1
        newest = max(good)
        acting = guard.act(now)
        acts = newest >= 0 and now - newest <= hold_ticks
        np.testing.assert_array_equal(acting.torque, good[newest] if acts else np.zeros(AXES))
        assert guard.is_safe == (not acts)
        assert guard.answered == newest
    assert guard.refused == refused


def test_released_there_is_no_torque_until_a_new_command() -> None:
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 0, 0, 1.0)
    guard.release()
    assert not guard.act(0).torque.any()
    assert offer(guard, 1, 1, 1.0)
    assert guard.act(1).torque.all()


class Way:
    """An exchange whose controller answers each tick with the tick's number as its torque."""

    def __init__(self, robot: Robot, *texts: str) -> None:
        names = RobotNames(robot.joint_names, ("wheel_1", "wheel_2"), ("thruster_1",))
        self.guard = CommandGuard(len(names.commanded), 10**6)
        self.codec = StateCodec(names, Timebase(round(PERIOD * 1e9)))
        settings = FaultSettings(faults=list(texts))
        self.exchange = PlantMessages(settings, names, PERIOD, self.codec, self.guard)
        self.state = RobotState.allocate(robot.n)

    def fly(self, ticks: int) -> tuple[list[list[int]], list[list[int]], list[int]]:
        """Stamps sent, answers awaited, and the tick whose command acts, tick by tick."""
        sent, awaited, acting = [], [], []
        for tick in range(ticks):
            self.state.tick = tick
            states = list(self.exchange.send(self.state))
            read = RobotState.allocate(len(self.state.joint_positions))
            sent.append([self._read(state, read) for state in states])
            awaited.append([s.answered_by for s in states if s.answered_by != NO_TICK])
            for stamp in awaited[-1]:
                self.guard.offered.tick, self.guard.offered.torque[:] = stamp, stamp
                self.exchange.take(tick)
            self.exchange.end(tick)
            torque = self.guard.act(tick).torque
            acting.append(int(torque[0]) if self.guard.answered >= 0 else NO_TICK)
        return sent, awaited, acting

    def _read(self, sent: SentState, state: RobotState) -> int:
        """The stamp that all parts have."""
        parts = zip(self.codec.topics, sent.messages, strict=True)
        (stamp,) = {self.codec.decode(topic, data, state) for topic, data in parts}
        return stamp


TICKS = list(range(12))
EACH = [[tick] for tick in TICKS]


@pytest.mark.parametrize("texts", [(), ("noise_gyro@0:1",), ("drop_state@0:0", "nan_command@1")])
def test_in_order_every_state_is_answered_and_every_command_acts(
    paper_robot: Robot, texts: tuple[str, ...]
) -> None:
    way = Way(paper_robot, *texts)
    assert way.fly(12) == (EACH, EACH, TICKS)


@pytest.mark.parametrize(
    ("text", "sent", "awaited", "acting"),
    [
        ("drop_state@0.001-0.002", [[0], [1], [], [], [4]], None, [0, 1, 1, 1, 4]),
        ("delay_state@0:2", [[], [], [0], [1], [2]], None, [NO_TICK, NO_TICK, 0, 1, 2]),
        ("repeat_state@0", [[0], [0, 1], [1, 2], [2, 3], [3, 4]], EACH[:5], TICKS[:5]),
        (
            "stamp_jump@0.001-0.0015",
            *([[0], [1], [1_000_002], [3], [4]], [[0], [1], [], [3], [4]], [0, 1, 1, 3, 4]),
        ),
        ("drop_command@0.001-0.002", EACH[:5], None, [0, 1, 1, 1, 4]),
        ("delay_command@0:2", EACH[:5], None, [NO_TICK, NO_TICK, 0, 1, 2]),
        ("nan_command@0.001-0.002", EACH[:5], None, [0, 1, 1, 1, 4]),
        ("repeat_command@0", EACH[:5], None, TICKS[:5]),
    ],
)
def test_what_is_sent_awaited_and_acts(
    paper_robot: Robot,
    text: str,
    sent: list[list[int]],
    awaited: list[list[int]] | None,
    acting: list[int],
) -> None:
    assert Way(paper_robot, text).fly(5) == (sent, awaited or sent, acting)
