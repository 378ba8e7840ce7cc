"""Eigenvalues with wrong masses: the sample against SciPy, within the bound."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.linalg
from closed_loop import H_BAR

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.inertia import inertia_along
from space_robot.tuning.mass_errors import check_masses, drawn_inertias, drawn_robots
from space_robot.tuning.postures import postures_along
from space_robot.tuning.spectrum import spectrum


@pytest.mark.parametrize("is_nominal", [False, True])
@pytest.mark.parametrize("share", [0.02, 0.2, 0.5])
def test_the_sample_is_within_the_bound_and_scipys(share: float, is_nominal: bool) -> None:
    flight = Flight(resolve(FlightPlan()))
    robot, mission = flight.plant.robot, flight.mission_settings
    inertia = inertia_along(robot, mission, 5.0)
    nominal = np.array([x.inertia for x in postures_along(flight.robot, mission, 5.0)])
    assumed = nominal if is_nominal else np.array(H_BAR)
    drawn = drawn_inertias(robot, mission, share, 5.0)
    check = check_masses(spectrum(inertia, assumed), assumed, drawn, share)
    expected = [
        scipy.linalg.eigh(nominal[k] if is_nominal else np.diag(H_BAR), own, eigvals_only=True)
        for sample in drawn
        for k, own in enumerate(sample)
    ]
    assert check.smallest_drawn == pytest.approx(np.min(expected), rel=1e-7)
    assert check.largest_drawn == pytest.approx(np.max(expected), rel=1e-7)
    assert check.smallest <= check.smallest_drawn < check.largest_drawn <= check.largest
    if is_nominal:  # the margin is that of the masses alone
        assert check.smallest == pytest.approx(1.0 / (1.0 + share))
        assert check.largest == pytest.approx(1.0 / (1.0 - share))


def test_draws_are_the_same_twice_and_within_their_share() -> None:
    robot = Flight(resolve(FlightPlan())).robot
    first, second = (list(drawn_robots(robot, 0.3, 50)) for _ in range(2))
    masses = np.array([own.mass / robot.mass for own in first])
    np.testing.assert_array_equal(masses, [own.mass / robot.mass for own in second])
    assert 0.7 <= masses.min() < 0.75
    assert 1.25 < masses.max() <= 1.3
    inertias = np.array([own.inertia[1] / robot.inertia[1] for own in first])
    assert np.ptp(inertias[:, 0, 0]) > 0.4
    assert not np.allclose(inertias[:, 0, 0], masses[:, 1])
