"""Panels in segments swing as the chain of rigid bodies and springs does that they are."""

from __future__ import annotations

import copy
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from paths import CONFIG

from space_robot_model.robot import Robot
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant, PlantSettings

Array = NDArray[np.float64]

FILE = read_yaml(CONFIG / "robots/flexible_panels.yaml")
PERIOD, TICKS = 5e-4, 100
SMALL = 1e-5
BASE_MASS, BASE_INERTIA, ROOT = 600.0, 225.0, 0.75
MASS, INERTIA, LENGTH = 2.5, 0.3, 1.2
STIFFNESS = np.array([75.0, 37.5, 37.5])
DAMPING = np.array([0.6, 0.3, 0.3])
BEAM = 45.0
"""EI of the beam that the panel stands for, N m2."""


def robot_of(base: float = 1.0, arm: float = 1e-9) -> Robot:
    """The shipped robot, its base heavier by a factor, its arm too light to matter."""
    content: dict[str, Any] = copy.deepcopy(FILE)
    factors = [base] + [arm] * 3
    for body, factor in zip(
        [content["robot"]["base"], *content["robot"]["links"]], factors, strict=False
    ):
        body["mass"] *= factor
        body["inertia"] = [factor * moment for moment in body["inertia"]]
    return Robot.from_dict(content)


def flown_eigenvalues(robot: Robot) -> Array:
    """(6,) Those with Im > 0 of the panels' linear motion, 1/s.

    The panels' state after 50 ms of free flight is differentiated by that before it: the base's own
    motion does not matter to them in first order.
    """
    p, rows = len(robot.springs), list(robot.order)
    places = [rows.index(robot.n + j) for j in range(p)]
    start = np.array([7 + row for row in places] + [13 + len(rows) + row for row in places])

    def after(number: int, value: float) -> Array:
        settings = PlantSettings(
            initial_joints_deg=[0.0] * robot.n, friction=FrictionSettings(coulomb=0.0, viscous=0.0)
        )
        plant = Plant(robot, settings, PERIOD)
        plant.memory.x[start[number]] = value
        for tick in range(TICKS):
            plant.step(Command(tick, np.zeros(3 + robot.n)))
        truth = plant.truth
        return np.concatenate([truth.passive_positions[:p], truth.passive_velocities[:p]])

    moved = [(after(k, SMALL) - after(k, -SMALL)) / (2.0 * SMALL) for k in range(2 * p)]
    found = np.log(np.linalg.eigvals(np.transpose(moved)).astype(complex)) / (PERIOD * TICKS)
    return _upper(found)


def chain_eigenvalues(is_free: bool) -> Array:
    """The same of the chain in the plane: heave and turn of the base, and the segments' turns.

    A segment's CoM is at ``z0 + b phi_0 + h (phi_1 + ... + phi_i-1) + h/2 phi_i``, phi about x; a
    panel on the other side is its mirror image.
    """
    run = LENGTH * (np.tril(np.ones((3, 3)), -1) + 0.5 * np.eye(3))
    heave = np.zeros((6, 8))
    heave[:, 0] = 1.0
    heave[:3, 1], heave[3:, 1] = ROOT, -ROOT
    heave[:3, 2:5], heave[3:, 5:8] = run, -run
    mass = MASS * heave.T @ heave + np.diag([BASE_MASS, BASE_INERTIA, *[INERTIA] * 6])
    bend = np.zeros((6, 8))
    for first in (0, 3):
        bend[first : first + 3, 2 + first : 5 + first] = np.eye(3) - np.eye(3, k=-1)
        bend[first, 1] = -1.0
    kept = np.arange(8) if is_free else np.arange(2, 8)
    mass, bend = mass[np.ix_(kept, kept)], bend[:, kept]
    stiffness = bend.T @ np.diag(np.tile(STIFFNESS, 2)) @ bend
    damping = bend.T @ np.diag(np.tile(DAMPING, 2)) @ bend
    size = len(kept)
    system = np.block(
        [
            [np.zeros((size, size)), np.eye(size)],
            [-np.linalg.solve(mass, stiffness), -np.linalg.solve(mass, damping)],
        ]
    )
    return _upper(np.linalg.eigvals(system))


def _upper(eigenvalues: Array) -> Array:
    upper = eigenvalues[eigenvalues.imag > 0.1]
    return upper[np.argsort(upper.imag)]


@pytest.mark.parametrize(("is_free", "heavier"), [(True, 1.0), (False, 1e9)])
def test_they_swing_as_the_chain_does(is_free: bool, heavier: float) -> None:
    """Frequency and damping of all six modes, of a base that floats and of one held still."""
    expected = chain_eigenvalues(is_free)
    flown = flown_eigenvalues(robot_of(heavier))
    assert len(flown) == 6
    np.testing.assert_allclose(flown, expected, rtol=1e-6, atol=0.0)


def test_the_chain_is_near_the_beam() -> None:
    """Euler and Bernoulli's cantilever: 0.2007 Hz; three segments are 5 % too low."""
    beam = 1.8751**2 * np.sqrt(BEAM / (MASS / LENGTH * (3 * LENGTH) ** 4))
    fixed, free = (chain_eigenvalues(is_free).imag for is_free in (False, True))
    assert fixed[0] == pytest.approx(fixed[1]), "one of each panel"
    assert fixed[0] / beam == pytest.approx(0.952, abs=0.001)
    assert free[1] > 1.05 * fixed[0], "a base that turns against its panels stiffens them"
