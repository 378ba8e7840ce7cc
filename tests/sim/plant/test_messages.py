"""What passes between plant and controller in a tick: in order, and with faults on the way."""

from __future__ import annotations

import numpy as np
import pytest

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


def test_a_lost_state_is_not_waited_for(paper_robot: Robot) -> None:
    sent, awaited, acting = Way(paper_robot, "drop_state@0.001-0.002").fly(6)
    assert sent == awaited == [[0], [1], [], [], [4], [5]]
    assert acting == [0, 1, 1, 1, 4, 5]


def test_a_late_state_is_answered_late(paper_robot: Robot) -> None:
    sent, awaited, acting = Way(paper_robot, "delay_state@0:2").fly(5)
    assert sent == awaited == [[], [], [0], [1], [2]]
    assert acting == [NONE, NONE, 0, 1, 2]


def test_a_state_that_comes_again_is_sent_and_not_awaited(paper_robot: Robot) -> None:
    sent, awaited, acting = Way(paper_robot, "repeat_state@0").fly(4)
    assert sent == [[0], [0, 1], [1, 2], [2, 3]]
    assert (awaited, acting) == (EACH[:4], TICKS[:4])


def test_a_wrong_stamp_is_awaited_only_if_it_can_be_answered(paper_robot: Robot) -> None:
    sent, awaited, acting = Way(paper_robot, "stamp_jump@0.001-0.0015").fly(4)
    assert sent == [[0], [1], [1_000_002], [3]]
    assert awaited == [[0], [1], [], [3]]
    assert acting == [0, 1, 1, 3]


@pytest.mark.parametrize(
    ("text", "acting"),
    [
        ("drop_command@0.001-0.002", [0, 1, 1, 1, 4, 5]),
        ("delay_command@0:2", [NONE, NONE, 0, 1, 2, 3]),
        ("nan_command@0.001-0.002", [0, 1, 1, 1, 4, 5]),
        ("repeat_command@0", [0, 1, 2, 3, 4, 5]),
    ],
)
def test_commands_fail_on_their_way(paper_robot: Robot, text: str, acting: list[int]) -> None:
    assert Way(paper_robot, text).fly(6) == (EACH[:6], EACH[:6], acting)


def test_spoilt_states_leave_the_plant_s_own_alone(paper_robot: Robot) -> None:
    way = Way(paper_robot, "nan_state@0", "stamp_back@0")
    way.fly(20)
    assert way.state.tick == 19
    assert np.isfinite(way.state.numbers).all()
