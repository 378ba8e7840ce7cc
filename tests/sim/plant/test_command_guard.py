"""The command in force, and what passes between plant and controller in a tick."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import example, given
from hypothesis import strategies as st

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.codecs import StateCodec
from space_robot_sim.plant.command_guard import CommandGuard
from space_robot_sim.plant.faults import FaultSettings
from space_robot_sim.plant.messages import (
    NONE,
    FaultyExchange,
    PlantMessages,
    SentState,
    exchange_of,
)

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
    guard, now, offered, good = CommandGuard(AXES, hold_ticks), 0, 0, {-1: [0.0] * AXES}
    for elapsed, commands in stream:
        now += elapsed
        for delay, torque in commands:
            stamp = now + delay
            is_good = max(good) < stamp <= now and all(np.isfinite(torque))
            assert offer(guard, now, stamp, torque) == is_good
            if is_good:
                good[stamp] = torque
            offered += 1
        newest = max(good)
        acting = guard.act(now)
        acts = newest >= 0 and now - newest <= hold_ticks
        np.testing.assert_array_equal(acting.torque, good[newest] if acts else np.zeros(AXES))
        assert guard.is_safe == (not acts)
        assert guard.answered == newest
    assert guard.refused.total() + len(good) - 1 == offered


@pytest.mark.parametrize(
    ("stamp", "torque", "reason"),
    [
        (5, 1.0, "stamp"),
        (4, 1.0, "stamp"),
        (7, 1.0, "stamp"),
        (6, np.nan, "not finite"),
        (6, -np.inf, "not finite"),
    ],
)
def test_a_refused_command_is_counted_and_changes_nothing(
    stamp: int, torque: float, reason: str
) -> None:
    """Repeated, older, of a state never sent, not finite."""
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 5, 5, 0.5)
    assert not offer(guard, 6, stamp, torque)
    assert guard.refused == {reason: 1}
    assert guard.act(6).torque.tolist() == [0.5] * AXES
    assert guard.answered == 5


def test_released_there_is_no_torque_until_a_new_command() -> None:
    guard = CommandGuard(AXES, HOLD)
    assert offer(guard, 0, 0, 1.0)
    guard.release()
    assert not guard.act(0).torque.any()
    assert offer(guard, 1, 1, 1.0)
    assert guard.act(1).torque.all()


PERIOD = 5e-4


class Way:
    """An exchange whose controller answers each tick with the tick's number as its torque."""

    def __init__(self, robot: Robot, *texts: str) -> None:
        names = RobotNames(robot.joint_names, ("wheel_1", "wheel_2"), ("thruster_1",))
        self.guard = CommandGuard(len(names.commanded), 10**6)
        self.codec = StateCodec(names, Timebase(round(PERIOD * 1e9)))
        settings = FaultSettings(faults=list(texts))
        self.exchange = exchange_of(settings, names, PERIOD, self.codec, self.guard)
        self.state = RobotState.allocate(robot.n)

    def fly(self, ticks: int) -> tuple[list[list[int]], list[list[int]], list[int]]:
        """Stamps sent, answers awaited, and the tick whose command acts, tick by tick."""
        sent, awaited, acting = [], [], []
        for tick in range(ticks):
            self.state.tick = tick
            states = list(self.exchange.send(self.state))
            read = RobotState.allocate(len(self.state.joint_positions))
            sent.append([self._read(state, read) for state in states])
            awaited.append([s.answered_by for s in states if s.answered_by != NONE])
            for stamp in awaited[-1]:
                self.guard.offered.tick, self.guard.offered.torque[:] = stamp, stamp
                self.exchange.take(tick)
            self.exchange.end(tick)
            acting.append(int(self.guard.act(tick).torque[0]) if self.guard.answered >= 0 else NONE)
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
    is_faulty = any("state" in text for text in texts)
    assert type(way.exchange) is (FaultyExchange if is_faulty else PlantMessages)


@pytest.mark.parametrize(
    ("text", "sent", "awaited", "acting"),
    [
        ("drop_state@0.001-0.002", [[0], [1], [], [], [4]], None, [0, 1, 1, 1, 4]),
        ("delay_state@0:2", [[], [], [0], [1], [2]], None, [NONE, NONE, 0, 1, 2]),
        ("repeat_state@0", [[0], [0, 1], [1, 2], [2, 3], [3, 4]], EACH[:5], TICKS[:5]),
        (
            "stamp_jump@0.001-0.0015",
            *([[0], [1], [1_000_002], [3], [4]], [[0], [1], [], [3], [4]], [0, 1, 1, 3, 4]),
        ),
        ("drop_command@0.001-0.002", EACH[:5], None, [0, 1, 1, 1, 4]),
        ("delay_command@0:2", EACH[:5], None, [NONE, NONE, 0, 1, 2]),
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


def test_spoilt_states_leave_the_plant_s_own_alone(paper_robot: Robot) -> None:
    way = Way(paper_robot, "nan_state@0", "stamp_back@0")
    way.fly(20)
    assert way.state.tick == 19
    assert np.isfinite(way.state.numbers).all()
