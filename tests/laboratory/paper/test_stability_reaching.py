"""Reaching times of made-up signals, and of flights."""

from __future__ import annotations

import numpy as np
import pytest

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.paper.stability.reaching import arrival, lyapunov_state, off_mission_plan, ripple

PERIOD = 0.01


def test_arrival_is_the_first_long_stay_below_the_threshold() -> None:
    s = np.ones((1000, 4))
    s[300:, 0] = 0.05  # stays
    s[200:250, 1] = 0.05  # half a second only
    s[400:600, 1] = -0.05  # two seconds, then pushed off again
    s[:, 2] = 0.0  # there from the start
    s[950:, 3] = 0.0  # too late to tell
    times = arrival(s, np.full(4, 0.1), PERIOD)
    np.testing.assert_allclose(times[:3], [3.0, 4.0, 0.0])
    assert np.isnan(times[3])


def test_ripple_leaves_out_the_rarest_ticks() -> None:
    s = np.full((10_000, 2), -1e-7)
    s[5] = 1.0
    np.testing.assert_allclose(ripple(s), 1e-7)


def test_psi_makes_the_paper_s_equations_true() -> None:
    """Both lines of (46) for an s that follows them: psi is eps less the law's integral."""
    k_1, k_2, period = 0.2, 3e-3, 1e-4
    time = period * np.arange(20_001)
    epsilon = 1e-3 * np.sin(time)
    s, integral, law = 1e-3, 0.0, []
    values = []
    for k in range(len(time)):
        values.append(s)
        law.append(integral)
        s += period * (epsilon[k] - k_1 * np.sqrt(abs(s)) * np.sign(s) - integral)  # (44)
        integral += period * k_2 * np.sign(values[-1])
    eta = lyapunov_state(np.array(values)[:, np.newaxis], np.array([k_1]), period)[:, 0]
    np.testing.assert_allclose(eta[:, 0] * np.abs(eta[:, 0]), values[:-1], atol=1e-15)
    np.testing.assert_allclose(eta[:, 1], (epsilon - law)[:-1], atol=1e-9)
    psi_rate = np.diff(eta[:, 1]) / period
    expected = -k_2 * np.sign(values[:-2]) + 1e-3 * np.cos(time[:-2])
    np.testing.assert_allclose(psi_rate, expected, atol=1e-6)


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
def test_flight_starts_with_the_same_error_on_every_axis(robot: str) -> None:
    flight = Flight(resolve(FlightPlan(robot=robot, duration=0.001, gains="tuned")))
    log = simulate(Flight(resolve(off_mission_plan(flight, 2e-3))))
    assert log.telemetry is not None
    np.testing.assert_allclose(log.telemetry[0, 3], 2e-3, rtol=1e-9)
    np.testing.assert_allclose(log.telemetry[0, 0], 3.0 * 2e-3, rtol=1e-9)  # s = lambda e


def test_further_parameters_of_the_plan_are_kept() -> None:
    parameters = {"plant": {"payload.mass": 7.0}, "controller": {"gains": "tuned"}}
    plan = off_mission_plan(Flight(resolve(FlightPlan(parameters=parameters))), 1e-3)
    assert plan.parameters["plant"]["payload.mass"] == 7.0
    assert plan.parameters["controller"] == parameters["controller"]
    assert Flight(resolve(plan)).plant.robot.mass[-1] == 7.0
