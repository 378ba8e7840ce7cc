"""The compiled loop of plant and controller, tick for tick what the nodes do."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from closed_loop import NAVIGATION, PERIOD, Loop, law_of

from space_robot import Robot
from space_robot.flight.closed_loop import close_loop
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis
from space_robot_control.navigation.settings import NavigationFilterSettings
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import DivergedError, SingularAttitudeError
from space_robot_msgs_py.samples import Timebase

TICKS = 300
LAWS = ["ctc", "tde_smc", "tde_tsmc", "tde_stc"]


def empty_log(loop: Loop, ticks: int = TICKS) -> FlightLog:
    log = FlightLog.allocate(ticks, loop.plant.robot.joint_names, Timebase(500_000))
    log.commanded_torque = np.full_like(log.applied_torque, np.nan)
    log.telemetry = np.full((ticks, 4, log.axes), np.nan)
    chunk = loop.mission.chunk(0, ticks)
    log.reference_joints[:], log.reference_base[:] = chunk.joints, chunk.base
    return log


def closed(loop: Loop, stretches: list[int]) -> FlightLog:
    log = empty_log(loop)
    for start, stop in itertools.pairwise(stretches):
        close_loop(loop.plant, loop.controller, log, start, stop)
    return log


@pytest.mark.parametrize("name", LAWS)
@pytest.mark.parametrize("latency", [0, 3])
@pytest.mark.parametrize("navigation", [None, NAVIGATION])
def test_compiled_flight_is_the_one_of_single_steps(
    paper_robot: Robot, name: str, latency: int, navigation: NavigationFilterSettings | None
) -> None:
    """Bit for bit, in one stretch or in several, with and without navigation filter."""
    options = {"navigation": navigation, "command_latency_ticks": latency}
    single = Loop(paper_robot, law_of(name), **options)
    errors, torques = single.fly(TICKS)
    for stretches in ([0, TICKS], [0, 1, 100, TICKS]):
        loop = Loop(paper_robot, law_of(name), **options)
        log = closed(loop, stretches)
        assert log.telemetry is not None
        np.testing.assert_array_equal(log.commanded_torque, torques)
        np.testing.assert_array_equal(log.telemetry[:, 3], errors)
        assert loop.plant.tick == TICKS
        np.testing.assert_array_equal(
            loop.plant.state.joint_positions, single.plant.state.joint_positions
        )
        for last, now in zip(single.controller.telemetry(), log.telemetry[-1], strict=True):
            np.testing.assert_array_equal(now, last)


class PlainGains(LawGains):
    h_bar: np.ndarray = per_axis("constant inertia", "kg m2")
    lambda_: np.ndarray = per_axis("slope of the sliding surface", "1/s")


class PlainTorque(ControlLaw):
    """A law without a kernel; the same equation as tde_stc's with K_1 = K_2 = 0."""

    name = "plain"
    gains_type = PlainGains

    def force(self, signals: Signals) -> np.ndarray:
        gains, x = self.gains, signals
        self.memory.s[:] = x.error_rate + gains.lambda_ * x.error
        self.memory.u[:] = x.acceleration_desired + gains.lambda_ * x.error_rate
        force: np.ndarray = gains.h_bar * self.memory.u + x.n_hat
        return force


def test_a_law_in_python_flies_as_its_compiled_twin(paper_robot: Robot) -> None:
    compiled = law_of("tde_stc")
    compiled.gain_values = {**compiled.gain_values, "k_1": np.zeros(9), "k_2": np.zeros(9)}
    plain = PlainTorque({k: compiled.gain_values[k] for k in ("h_bar", "lambda")}, PERIOD)
    one, other = (closed(Loop(paper_robot, law), [0, TICKS]) for law in (compiled, plain))
    assert one.telemetry is not None
    assert other.telemetry is not None
    np.testing.assert_array_equal(one.commanded_torque, other.commanded_torque)
    np.testing.assert_array_equal(one.telemetry, other.telemetry)
    np.testing.assert_array_equal(one.quaternion, other.quaternion)


def test_divergence_is_found_at_its_tick(paper_robot: Robot) -> None:
    """As in single steps."""
    ticks = []
    for fly in (lambda loop: closed(loop, [0, TICKS]), lambda loop: loop.fly(TICKS)):
        law = law_of("ctc")
        law.gain_values = {"k_p": np.full(9, 5e6), "k_d": np.full(9, 5e4)}
        with pytest.raises(DivergedError) as caught:
            fly(Loop(paper_robot, law))
        ticks.append(caught.value.tick)
    assert ticks[0] == ticks[1] < 20


def test_singular_attitude_is_named_with_its_tick(paper_robot: Robot) -> None:
    loop = Loop(paper_robot, law_of("tde_stc"), initial_quaternion=[0.0, 0.0, 1.0, 0.0])
    with pytest.raises(SingularAttitudeError, match="180 degrees") as caught:
        closed(loop, [0, TICKS])
    assert caught.value.tick == 0
