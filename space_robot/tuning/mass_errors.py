"""Eigenvalues of ``H_S^-1 H^`` of a robot whose masses and inertias are wrong.

By the bound of `spectrum` they stay between ``lambda / (1 + mu)`` and ``lambda / (1 - mu)``. How
much of that is used is estimated from a sample of robots, each body of which has its own factor on
its mass and its own on its inertia.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.robot import Robot

from .inertia import inertia_along
from .spectrum import Spectrum, eigenvalues

Array = NDArray[np.float64]

DRAWS, SEED = 16, 1
"""Size and seed of the sample."""
COARSE = 1.0
"""Time between two configurations in which it is evaluated, s."""


@dataclass(frozen=True)
class MassCheck:
    """Extreme eigenvalues with masses and inertias wrong by up to a share."""

    share: float
    """mu."""
    smallest: float
    """Bound: it is the margin in torque scale, if the largest one times the weight is below 2."""
    largest: float
    """Bound."""
    smallest_drawn: float
    """The smallest one of the sample."""
    largest_drawn: float
    """The largest one of the sample."""


def drawn_robots(
    robot: Robot, share: float, count: int = DRAWS, seed: int = SEED
) -> Iterator[Robot]:
    """Yield robots whose bodies' masses and inertias are wrong by up to ``share``.

    Args:
        robot: with the right ones.
        share: mu; the factors are uniform in ``1 - mu`` to ``1 + mu``.
        count: of robots.
        seed: of the generator.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        of_mass, of_inertia = 1.0 + share * rng.uniform(-1.0, 1.0, (2, len(robot.mass)))
        yield replace(
            robot,
            mass=robot.mass * of_mass,
            inertia=robot.inertia * of_inertia[:, np.newaxis, np.newaxis],
        )


def drawn_inertias(
    robot: Robot,
    settings: MissionSettings,
    share: float,
    step: float = COARSE,
    controls_base: bool = True,
) -> Array:
    """Return H_S, or H_f, (R, L, m, m) of `drawn_robots` along a mission, see `inertia_along`."""
    return np.array(
        [
            inertia_along(wrong, settings, step, controls_base)
            for wrong in drawn_robots(robot, share)
        ]
    )


def check_masses(spectrum: Spectrum, assumed: Array, drawn: Array, share: float) -> MassCheck:
    """Return the extreme eigenvalues with wrong masses.

    Args:
        spectrum: with the right ones.
        assumed: H^, (m,) diagonal, or (L, m, m) in the configurations of ``drawn``.
        drawn: (R, L, m, m), see `drawn_inertias`.
        share: mu.
    """
    eigen = eigenvalues(drawn, assumed)
    return MassCheck(
        share,
        spectrum.smallest / (1.0 + share),
        spectrum.largest / (1.0 - share),
        float(eigen.min()),
        float(eigen.max()),
    )
