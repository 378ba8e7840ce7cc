"""Whatever is measured and wanted, C answers as the supervisor in Python does, to the bit."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest
from exported_kernels import needs_compiler
from hypothesis import example, given, settings
from hypothesis import strategies as st

from space_robot.export.software import export
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot_control.controller.signals import USABLE
from space_robot_control.controller.supervisor import Supervisor
from space_robot_control.controller.tick import (
    NEW,
    NO_REFERENCE,
    NOMINAL_FROM_ETA,
    REFERENCE_HELD,
    SAFE_BELOW_ETA,
    STATUSES,
)
from space_robot_control.flight_code.acceptance import (
    corrupt_state,
    corrupted_reference,
    disturb_state,
    hostile_ticks,
)
from space_robot_control.flight_code.folder import Exported
from space_robot_control.flight_code.instances import CONDITION, FlightLibrary
from space_robot_control.flight_code.supervisors import bits
from space_robot_msgs_py.samples import Reference, RobotState

pytestmark = needs_compiler
TICKS = 150
TOLD = {NO_REFERENCE: "no reference", REFERENCE_HELD: "reference held"}
SETTINGS = {"navigation": "filtered", "sensors": "fine", "actuators": "wheels_and_thrusters"}


def flight_of(law: str) -> Flight:
    return Flight(resolve(Scenario(controller=law, **SETTINGS)))


@cache
def exported(law: str) -> Exported:
    return export(flight_of(law))


@settings(max_examples=8)
@given(st.integers(0, 2**32 - 1), st.sampled_from(["tde_stc", "ctc"]), st.floats(0.0, 1.0))
@example(0, "tde_stc", 1.0)
@example(1, "ctc", 0.0)
def test_c_answers_like_python(seed: int, law: str, share: float) -> None:
    flight, code, random = flight_of(law), FlightLibrary(exported(law)), np.random.default_rng(seed)
    limits = flight.controller_settings.hold_ticks, flight.controller_settings.longest_jump
    supervisor = Supervisor(flight.controller, *limits)
    references = flight.mission.chunk(0, TICKS).references()
    wheels = len(flight.plant.names.wheels)
    for k, tick in enumerate(hostile_ticks(TICKS, random)):
        standing = supervisor.judge_stamp(tick)
        assert code.judge_stamp(tick) == standing
        if standing == NEW:
            state, reference = flight.plant.state.copy(), references[k : k + 1]
            state.tick = tick
            disturb_state(state, 10.0 ** random.uniform(-8, 0), random)
            desired = reference["quaternion"][0]
            corrupt_state(state, wheels, random, desired, is_hostile=random.random() < share)
            if random.random() < share:
                reference = corrupted_reference(reference, random)
            command, status = supervisor.answer(state, reference), code.answer(state, reference)
            np.testing.assert_array_equal(bits(code.command), bits(command.torque))
            assert bool(status) == bool(supervisor.reason)
            assert TOLD.get(status, supervisor.reason) == supervisor.reason
        condition = dict(zip(CONDITION[:5], code.condition, strict=False))
        assert condition["answered"] == supervisor.answered
        assert condition["last_stamp"] == supervisor.last_stamp
        assert code.condition[5:].sum() == supervisor.rejected.total()


@pytest.mark.parametrize("desired", [[1.0, 0.0, 0.0, 0.0], [0.1, 0.7, -0.5, 0.5]])
def test_corrupted_states_meet_half_a_turn_from_wherever_the_base_should_be(
    desired: list[float],
) -> None:
    """Both sides of the limits of `supervision`, which look at the error."""
    random, q_d, etas = np.random.default_rng(1), np.array(desired), []
    for _ in range(400):
        state = RobotState.allocate(6)
        state.quaternion[:] = q_d
        with np.errstate(all="ignore"):
            corrupt_state(state, 0, random, q_d)
        if not (np.abs(state.quaternion) < 2.0).all():
            continue
        if abs(np.linalg.norm(state.quaternion) - 1.0) < 1e-12:
            etas.append(abs(float(state.quaternion @ q_d)))
    assert min(etas) < 1e-9
    assert any(0.0 < eta < SAFE_BELOW_ETA for eta in etas)
    assert any(SAFE_BELOW_ETA < eta < NOMINAL_FROM_ETA for eta in etas)


def test_bad_references_are_held_and_told() -> None:
    """The law goes on, and keeps nothing of them; before the first good one there is none to hold.

    A quaternion that is not unit is one: what rounding makes of a unit one flies.
    """
    flight, code = flight_of("ctc"), FlightLibrary(exported("ctc"))
    supervisor = Supervisor(flight.controller, flight.controller_settings.hold_ticks)
    references, state = flight.mission.chunk(0, 12).references(), flight.plant.state.copy()
    scales = [np.nan, 1.0, 1.0001, 0.0, 0.9, 1.001, 1e20, -1.0, np.inf, 1.0]
    statuses = []
    for tick, scale in enumerate(scales):
        reference = references[tick : tick + 1].copy()
        with np.errstate(invalid="ignore"):
            reference["quaternion"] *= scale
        if tick == 9:
            Reference.parts(reference)[0].reshape(-1)[2] = np.nan
        state.tick = tick
        command = supervisor.answer(state, reference)
        statuses.append(code.answer(state, reference))
        assert supervisor.reason == TOLD.get(statuses[-1], "")
        np.testing.assert_array_equal(bits(code.command), bits(command.torque))
        assert np.isfinite(np.concatenate([code.command, *code.telemetry])).all()
    held, good = REFERENCE_HELD, USABLE
    assert statuses == [NO_REFERENCE, good, good, held, held, held, held, good, held, held]
    rejected = dict(zip(range(STATUSES), code.condition[5:], strict=True))
    assert (rejected[NO_REFERENCE], rejected[held], sum(rejected.values())) == (1, 6, 7)
