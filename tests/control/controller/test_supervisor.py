"""Safe mode: finite commands whatever is measured, held, then none, and the way back."""

from __future__ import annotations

from contextlib import suppress
from typing import Any

import numpy as np
import pytest
from closed_loop import GAINS, PERIOD, Loop, law_of
from hypothesis import example, given, settings
from hypothesis import strategies as st

from space_robot_control.controller.controller import Controller
from space_robot_control.controller.reference_buffer import ReferenceBuffer
from space_robot_control.controller.signals import LARGEST
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.controller.tick import (
    HOLDING,
    NOMINAL,
    NOMINAL_FROM_ETA,
    SAFE,
    SAFE_BELOW_ETA,
)
from space_robot_control.controller.time_delay_estimation import LONGEST_GAP
from space_robot_control.laws import ControlLaw, LawGains, Signals
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.errors import MessageError, UnusableStateError
from space_robot_msgs_py.samples import STATE_FIELDS, Reference, RobotState

AXES, HOLD = 9, 5
REST = Reference.at_rest(6)
"""The reference that asks for rest at zero."""


class Held(ControlLaw):
    """A law in Python: one force on every axis."""

    name = "held"
    gains_type = LawGains

    def force(self, signals: Signals) -> Array:
        force: Array = np.ones(signals.error.size)
        return force


def supervisor_of(robot: Robot, name: str = "tde_stc", hold_ticks: int = HOLD) -> Supervisor:
    return Supervisor(Controller(robot, law_of(name), PERIOD), hold_ticks)


def state_at(tick: int, eta: float = 1.0, scale: float = 1.0) -> RobotState:
    """At rest, turned about x so far that the quaternion's first element is ``eta``."""
    state = RobotState.allocate(6)
    state.tick = tick
    state.quaternion[:2] = scale * np.array([eta, np.sqrt(1.0 - eta**2)])
    state.joint_positions[:] = 0.01
    return state


def with_nan(state: RobotState) -> RobotState:
    state.joint_velocities[3] = np.nan
    return state


def moving(tick: int) -> Block:
    """All axes move, and speed up."""
    reference = Reference.at_rest(6)
    joints, base = Reference.parts(reference)
    joints[:], base[:, 4:] = 0.01 + 1e-4 * tick, 1e-3
    return reference


@pytest.mark.parametrize("name", ["ctc", "tde_stc"])
def test_a_bad_reference_is_held_as_a_buffer_holds_it(paper_robot: Robot, name: str) -> None:
    """And no law keeps anything of it."""
    bad = {4: (0, np.nan), 5: (17, -np.inf), 6: (22, 1.1e30), 11: (26, np.inf), 12: (18, np.nan)}
    supervisor, other = supervisor_of(paper_robot, name), supervisor_of(paper_robot, name)
    buffer = ReferenceBuffer(6)
    for tick in range(20):
        reference = moving(tick)
        if tick in bad:
            place, number = bad[tick]
            reference.view(np.float64)[place] = number
        joints, base = Reference.parts(reference)
        with suppress(MessageError):
            buffer.add_joints(tick, joints)
            buffer.add_base(tick, base)
        held = buffer.at(tick) if buffer.covers(tick) else buffer.hold(tick)
        assert held is not None
        answer = other.answer(state_at(tick), held).torque
        np.testing.assert_array_equal(supervisor.answer(state_at(tick), reference).torque, answer)
        for mine, expected in zip(supervisor.telemetry(), other.telemetry(), strict=True):
            np.testing.assert_array_equal(mine, expected)
        assert supervisor.mode == NOMINAL
        assert supervisor.reason == ("reference held" if tick in bad else "")
    assert supervisor.rejected == {"reference held": 5}


@pytest.mark.parametrize("law", [law_of("tde_stc"), Held({}, PERIOD, AXES)])
def test_before_the_first_reference_no_law_answers(paper_robot: Robot, law: ControlLaw) -> None:
    supervisor = Supervisor(Controller(paper_robot, law, PERIOD), HOLD)
    nothing = moving(0)
    nothing.view(np.float64)[3] = np.nan
    for tick in range(HOLD + 2):
        assert not supervisor.answer(state_at(tick), nothing).torque.any()
        assert supervisor.mode == (HOLDING if tick < HOLD else SAFE)
        assert supervisor.reason == "no reference"
    supervisor.answer(state_at(HOLD + 2), moving(0))  # it takes over from no torque
    assert supervisor.mode == NOMINAL
    assert supervisor.answer(state_at(HOLD + 3), nothing).torque.any()
    assert supervisor.rejected == {"no reference": HOLD + 2, "reference held": 1}


# Any stream of states


numbers = st.lists(st.floats(width=64) | st.floats(-2.0, 2.0), min_size=34, max_size=34)
unit = st.lists(st.floats(-1.0, 1.0), min_size=4, max_size=4).filter(
    lambda q: np.hypot(*q[:2]) > 1e-3
)
ticks = st.integers(1, 3) | st.integers(-100, 10_000)
streams = st.lists(st.tuples(ticks, numbers, st.none() | unit), min_size=1, max_size=30)
"""Step in ticks, all the measured numbers, and a unit quaternion in place of any."""


def assert_safe(supervisor: Supervisor, state: RobotState) -> None:
    """A finite command for the state's tick, none in safe mode; the reason is known."""
    before = supervisor.rejected.total()
    command = supervisor.answer(state, REST)
    assert np.isfinite(command.torque).all()
    assert command.tick == state.tick
    nominal = supervisor.mode == NOMINAL
    assert nominal == (supervisor.reason == "")
    assert supervisor.rejected.total() - before == (not nominal)
    if supervisor.mode == SAFE:
        assert not command.torque.any()


@settings(max_examples=100)
@given(st.sampled_from(sorted(GAINS)), streams)
@example("tde_stc", [(1, [1e300] * 34, [1.0, 0.0, 0.0, 0.0])] * 3)
def test_whatever_is_measured_commands_are_finite_and_it_comes_back(
    paper_robot: Robot, name: str, stream: list[tuple[int, list[float], list[float] | None]]
) -> None:
    supervisor, tick = supervisor_of(paper_robot, name), 0
    for step, values, quaternion in stream:
        tick = max(0, tick + step)
        state = RobotState.allocate(6)
        parts = [getattr(state, field) for field in STATE_FIELDS]
        ends = np.cumsum([len(part) for part in parts])
        for part, column in zip(parts, np.split(np.array(values), ends[:-1]), strict=True):
            part[:] = column
        if quaternion is not None:
            state.quaternion[:] = np.array(quaternion) / np.linalg.norm(quaternion)
        state.tick = tick
        assert_safe(supervisor, state)
    for k in range(1, 4):
        assert_safe(supervisor, state_at(tick + k))
        assert supervisor.mode == NOMINAL


@given(st.lists(st.booleans(), min_size=1, max_size=60), st.integers(0, HOLD))
def test_a_bad_state_is_answered_with_the_last_torque_for_a_while(
    paper_robot: Robot, good: list[bool], hold_ticks: int
) -> None:
    """After ``hold_ticks`` of them in a row with none; a good one is answered by the law again."""
    supervisor, bad, last = supervisor_of(paper_robot, hold_ticks=hold_ticks), 0, np.zeros(AXES)
    for tick, is_good in enumerate(good):
        state = state_at(tick)
        command = supervisor.answer(state if is_good else with_nan(state), REST)
        bad = 0 if is_good else bad + 1
        if is_good:
            assert supervisor.mode == NOMINAL
            last = command.torque.copy()
        else:
            assert supervisor.mode == (HOLDING if bad <= hold_ticks else SAFE)
            np.testing.assert_array_equal(command.torque, last if bad <= hold_ticks else 0.0 * last)
    assert supervisor.rejected.total() == good.count(False)


BAD: list[tuple[str, Any, Any, str]] = [
    ("omega_base", slice(3), np.nan, "state not finite"),
    ("applied_torque", slice(9), -np.inf, "state not finite"),
    ("quaternion", slice(4), np.inf, "state not finite"),
    *(
        (field, place, number, "state not finite")
        for place in (0, -1)
        for field, number in (
            ("quaternion", np.nan),
            ("omega_base", np.inf),
            ("joint_positions", np.nan),
            ("joint_velocities", -np.inf),
            ("applied_torque", np.nan),
        )
    ),
    ("joint_velocities", 0, -2.0 * LARGEST, "state too large"),
    ("joint_velocities", -1, -2.0 * LARGEST, "state too large"),
    ("applied_torque", -1, 1e300, "state too large"),
    ("joint_positions", slice(6), 1e200, "state too large"),
    ("joint_velocities", slice(2), [np.inf, -np.inf], "state not finite"),
    ("joint_velocities", slice(2), [1e200, -1e200], "state too large"),
    ("quaternion", 0, 1.1, "quaternion not unit"),
    ("quaternion", slice(4), 0.0, "quaternion not unit"),
]


@pytest.mark.parametrize(("field", "place", "number", "kind"), BAD)
def test_a_bad_state_is_counted_held_over_and_leaves_no_trace(
    paper_robot: Robot, field: str, place: Any, number: Any, kind: str
) -> None:
    """Wherever bad numbers stand, of any sign; an attitude of zeros is a broken sensor."""
    shown, spared = (Supervised(paper_robot, "tde_stc", HOLD) for _ in range(2))
    before, _ = (loop.fly(20)[1][-1] for loop in (shown, spared))
    state, reference = shown.plant.state.copy(), shown.references.at(20)
    getattr(state, field)[place] = number
    held = shown.supervisor.answer(state, reference).torque
    np.testing.assert_array_equal(held, before)
    assert shown.supervisor.rejected == {kind: 1}
    assert shown.supervisor.mode == HOLDING
    with pytest.raises(UnusableStateError, match="at tick 20 the") as caught:
        shown.controller.update(state, reference)
    assert (caught.value.tick, caught.value.kind) == (20, kind)
    torques = shown.fly(20)[1]
    np.testing.assert_array_equal(torques, spared.fly(20)[1])


# Near half a turn


def test_near_half_a_turn_it_is_safe_until_well_away(paper_robot: Robot) -> None:
    supervisor = supervisor_of(paper_robot)
    between = 0.5 * (SAFE_BELOW_ETA + NOMINAL_FROM_ETA)
    modes = []
    etas = [0.5, between, 0.9 * SAFE_BELOW_ETA, between, 1.1 * NOMINAL_FROM_ETA, -between]
    for tick, eta in enumerate(etas):
        assert_safe(supervisor, state_at(tick, eta))
        modes.append(supervisor.mode)
    assert modes == [NOMINAL] * 2 + [SAFE] * 2 + [NOMINAL] * 2
    assert supervisor.rejected == {"attitude error near 180 degrees": 2}


def test_half_a_turn_is_that_of_the_error(paper_robot: Robot) -> None:
    """A base half a turn from the inertial frame flies where it is desired there."""
    supervisor, turned = supervisor_of(paper_robot), REST.copy()
    turned["quaternion"][0] = state_at(0, 0.0).quaternion
    other_sign = turned.copy()
    other_sign["quaternion"] *= -1.0
    for tick, (eta, reference, mode) in enumerate(
        [
            (0.0, turned, NOMINAL),
            (SAFE_BELOW_ETA / 2, turned, NOMINAL),
            (1.0, turned, SAFE),
            (1.0, REST, NOMINAL),
            (0.0, REST, SAFE),
            (0.0, other_sign, NOMINAL),
        ]
    ):
        command = supervisor.answer(state_at(tick, eta), reference)
        assert supervisor.mode == mode, tick
        assert np.isfinite(command.torque).all()
    assert supervisor.rejected == {"attitude error near 180 degrees": 2}


@pytest.mark.parametrize("law", [law_of("tde_stc"), Held({}, PERIOD, AXES)])
def test_a_free_base_has_no_singular_attitude_and_gets_no_torque(
    paper_robot: Robot, law: ControlLaw
) -> None:
    """Nothing turns it, so no J0 is asked for, wherever it is, whatever the law asks for."""
    free = BaseActuatorSettings(base_actuation="none")
    supervisor = Supervisor(Controller(paper_robot, law, PERIOD, actuators=free), HOLD)
    for tick, eta in enumerate([1.0, 0.03, 1e-3, 0.0, -1e-9, -0.5]):
        torque = supervisor.answer(state_at(tick, eta), REST).torque
        np.testing.assert_array_equal(torque[:3], 0.0)
        assert torque[3:].all()
        assert supervisor.mode == NOMINAL
    assert not supervisor.rejected


# Time


@pytest.mark.parametrize("begin", [0, 50, 5000])
def test_after_a_jump_in_time_it_answers_as_a_new_one(paper_robot: Robot, begin: int) -> None:
    """Bit for bit: the plant has started anew, or states have long been missing."""
    used, new = supervisor_of(paper_robot), supervisor_of(paper_robot)
    for tick in range(1000, 1100):
        used.answer(state_at(tick, 0.9), REST)
    for tick in range(begin, begin + 60):
        command = used.answer(state_at(tick, 0.8), REST).torque
        np.testing.assert_array_equal(command, new.answer(state_at(tick, 0.8), REST).torque)


def test_time_that_goes_back_while_holding_does_not_make_it_hold_for_longer(
    paper_robot: Robot,
) -> None:
    supervisor = supervisor_of(paper_robot)
    supervisor.answer(state_at(1000), REST)
    for tick in (1001, 3):
        supervisor.answer(with_nan(state_at(tick)), REST)
    assert supervisor.mode == SAFE


def test_standing_down_commands_nothing_and_forgets(paper_robot: Robot) -> None:
    supervisor = supervisor_of(paper_robot)
    for tick in range(40):
        supervisor.answer(state_at(tick), REST)
    command = supervisor.deactivate(40)
    assert command.tick == 40
    assert not command.torque.any()
    assert not supervisor.answer(with_nan(state_at(41)), REST).torque.any()


# In flight


class Supervised(Loop):
    """A loop in which a supervisor answers what a faulty sensor reports."""

    def __init__(self, robot: Robot, name: str, hold_ticks: int) -> None:
        super().__init__(robot, law_of(name))
        self.supervisor = Supervisor(self.controller, hold_ticks)
        self.answer = self.supervisor.answer


@pytest.mark.parametrize("name", ["ctc", "tde_stc"])
@pytest.mark.parametrize("blind_ticks", [1, LONGEST_GAP - 1, LONGEST_GAP + 5, 300])
def test_a_blind_flight_finds_back_without_a_jolt(
    paper_robot: Robot, name: str, blind_ticks: int
) -> None:
    """Over a blink it holds; over 150 ms (100 of them without torque) it falls behind a little."""
    loop = Supervised(paper_robot, name, hold_ticks=100)
    loop.fly(2000)
    before = loop.fly(1)[1][-1]
    _, torques = loop.fly(blind_ticks, is_blind=True)
    np.testing.assert_array_equal(torques[:100], np.broadcast_to(before, torques[:100].shape))
    assert not torques[100:].any()
    applied = loop.plant.state.applied_torque.copy()
    errors, torques = loop.fly(4000)
    assert loop.supervisor.mode == NOMINAL
    if blind_ticks > LONGEST_GAP:  # it takes over from what is applied
        np.testing.assert_allclose(torques[0], applied, atol=1e-9)
    else:  # the law goes on, its estimate a few ticks old
        np.testing.assert_allclose(torques[0], applied, atol=0.05)
    assert np.abs(errors).max() < (1e-4 if blind_ticks < 100 else 1e-2)
    assert np.abs(errors[-1]).max() < (1e-4 if blind_ticks < 100 else 2e-3)
