"""Which law answers, what is told of it, and that no tick is answered anew."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pytest
from closed_loop import GAINS, PERIOD, law_of
from hypothesis import given
from hypothesis import strategies as st

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.law_choice import LawChoice
from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.controller.supervisor import StateResponder, Supervisor
from space_robot_control.controller.tick import ANSWERED, NEW, REFUSED
from space_robot_control.laws import ControlLaw
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import Command, Reference, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec
from space_robot_msgs_py.wire.stamp_guard import AGREEING

LAWS: dict[str, ControlLaw] = {name: law_of(name) for name in GAINS}
DECIMATION = 4


@given(
    st.lists(st.integers(0, 40), max_size=4, unique=True).map(sorted),
    st.lists(st.tuples(st.integers(1, 15), st.sampled_from([None, *LAWS])), max_size=12),
    st.randoms(use_true_random=False),
)
def test_the_law_is_the_last_one_planned_or_chosen(
    swaps: Sequence[int], answers: list[tuple[int, str | None]], random: object
) -> None:
    """Over ticks that were lost, too; a change is told once, from the law told before."""
    planned = [(tick, LAWS[random.choice(list(LAWS))]) for tick in swaps]  # type: ignore[attr-defined]
    choice, in_force = LawChoice(LAWS["ctc"], planned), LAWS["ctc"]
    tick, told = -1, None
    for step, by_hand in answers:
        if by_hand:
            choice.choose(LAWS[by_hand])
            in_force = LAWS[by_hand]
        due = [law for when, law in planned if tick < when <= tick + step]
        tick, in_force = tick + step, [in_force, *due][-1]
        change = choice.change_at(tick)
        assert choice.chosen is in_force
        assert choice.was_swapped == bool(due)
        choice.was_swapped = False
        assert (change is not None) == (in_force.name != told)
        if change:
            assert (change.law.name, change.law.tick) == (in_force.name, tick)
            assert (change.before.name if change.before else None) == told
            assert change.law.is_first == (told is None)
        told = in_force.name


def test_other_gains_of_a_law_are_a_change_and_the_same_ones_are_none() -> None:
    law = law_of("ctc")
    choice = LawChoice(law)
    assert choice.change_at(0)
    law.gain_values = {**law.gain_values, "k_d": np.full(9, 7.0)}
    assert choice.change_at(1) is None, "nobody has said so"
    choice.choose(law)
    change = choice.change_at(2)
    assert change is not None
    assert str(change) == "ctc: other k_d"
    assert change.law.gains["k_d"] == (7.0,) * 9
    choice.choose(law)
    assert choice.change_at(3) is None


class Bench:
    """A controller that answers states of a robot at rest."""

    def __init__(self, robot: Robot, **swaps: int) -> None:
        self.controller = Controller(robot, law_of("ctc"), PERIOD)
        self.references = ReferenceBuffer(robot.n)
        settings = ControllerNodeSettings.resolve(
            {"telemetry_decimation": DECIMATION, "longest_jump": 50}
        )
        self.choice = LawChoice(
            self.controller.law, [(tick, law_of(name)) for name, tick in swaps.items()]
        )
        supervisor = Supervisor(self.controller, settings.hold_ticks, settings.longest_jump)
        self.answering = StateResponder(supervisor, self.choice, self.references, settings)
        self._codec = CommandCodec(self.controller.names.commanded, settings.timebase)
        self._state = RobotState.allocate(robot.n)
        self._state.quaternion[:] = [0.9, 0.3, -0.1, 0.3]
        self._state.applied_torque[:] = 0.1

    def answer(self, tick: int) -> tuple[list[topics.Topic], Command]:
        """The topics of the messages, and the command."""
        sent = list(self.answering.messages(tick, self._state, Reference.at_rest(6)))
        (data,) = (data for topic, data in sent if topic is topics.COMMAND)
        command = Command(-1, np.zeros(9))
        self._codec.decode(data, command)
        assert data == self.answering.answer
        return [topic for topic, _ in sent], command


def test_a_state_is_answered_once_and_a_new_time_believed_late(paper_robot: Robot) -> None:
    bench = Bench(paper_robot)
    judge = bench.answering.judge_stamp
    for tick in (3, 4, 53):
        assert judge(tick) == NEW
        assert judge(tick) == NEW, "it waits for its reference"
        bench.answer(tick)
        assert judge(tick) == ANSWERED
        assert bench.references.now == tick
    for other in (1000, 2, 104):
        assert judge(other) == REFUSED
    assert bench.references.now == 53
    begun: list[int] = []
    bench.references.begin = begun.append  # type: ignore[method-assign]
    verdicts = [judge(tick) for tick in range(7, 7 + AGREEING)]
    assert verdicts == [REFUSED] * (AGREEING - 1) + [NEW]
    assert begun == [6 + AGREEING]


@pytest.mark.parametrize("first", [0, 6])
def test_the_law_is_told_before_the_command_and_telemetry_after_it(
    paper_robot: Robot, first: int
) -> None:
    """A law that takes over goes on from the torque that is applied."""
    bench = Bench(paper_robot, tde_stc=first + 3)
    for tick in range(first, first + 8):
        sent, command = bench.answer(tick)
        is_news = tick in (first, first + 3)
        telemetry = [topics.TELEMETRY, topics.SIGNALS] if tick % DECIMATION == 0 else []
        assert sent == [*([topics.LAW] if is_news else []), topics.COMMAND, *telemetry]
        assert (bench.answering.change is not None) == is_news
        assert (command.tick, bench.answering.supervisor.answered) == (tick, tick)
        assert bench.controller.law.name == ("ctc" if tick < first + 3 else "tde_stc")
        if tick == first + 3:
            np.testing.assert_allclose(command.torque, 0.1, atol=1e-9)


def test_other_gains_leave_a_law_its_memory(paper_robot: Robot) -> None:
    """It goes on, and takes nothing over."""
    bench = Bench(paper_robot, tde_stc=0)
    for tick in range(5):
        bench.answer(tick)
    law = bench.controller.law
    before = law.memory.psi.copy()
    assert before.any()
    law.gain_values = {**law.gain_values, "k_2": np.zeros(9)}  # so that it stands
    bench.choice.choose(law)
    assert topics.LAW in bench.answer(5)[0]
    np.testing.assert_array_equal(law.memory.psi, before)
    assert bench.controller.block[0].transfer_left == 0.0
