"""Bends of a path between two postures with which it asks less of the base in the same time.

The momentum of the joints' motion depends on the path between the postures: the joints also move
in the reaction null space, and take the rest of their way where the coupling is small.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.courses import BentLeg, Course
from space_robot_control.guidance.demand import demand
from space_robot_model.robot import Robot

Array = NDArray[np.float64]

BENDS = 2
"""Number of sines."""
SAMPLES = 80
"""Of the path during the search."""
NORM = 8
"""Exponent of the norm over time that stands for the maximum, so that it has derivatives."""
COST = 1e-4
"""Of the square of the bends, rad or m, beside a demand of 1: they are not larger than of use."""
STEPS = 60
DIGITS = 3
"""Bends are rounded to this many digits, degrees."""


def best_bends(
    robot: Robot, leg: BentLeg, base: Course, of_torque: bool
) -> tuple[list[list[float]], float]:
    """Return bends in degrees (m for prismatic joints), and what is left of the demand, as a share.

    Args:
        robot: as the flight software knows it.
        leg: a leg, whose own bends do not count.
        base: course of the base during the leg.
        of_torque: whether the largest torque on the base is to fall; else the largest momentum.
    """
    from scipy.optimize import minimize  # slow to import

    shape = (BENDS, len(leg.start))

    def asked(bends: Array, samples: int = 0) -> Array:
        course = leg._replace(bends=bends.reshape(shape))
        end = leg.begin + leg.span
        sampled = demand(robot.nominal, course, base, leg.begin, end, samples)
        return sampled.base_torque if of_torque else sampled.stored_momentum

    scale = float(asked(np.zeros(shape)).max())
    if scale == 0.0:
        return [], 1.0

    def cost(bends: Array) -> float:
        shares = asked(bends, SAMPLES) / scale
        return float(np.mean(shares**NORM) ** (1.0 / NORM) + COST * bends @ bends)

    solution = minimize(
        cost, np.zeros(BENDS * shape[1]), method="L-BFGS-B", options={"maxiter": STEPS}
    )
    degrees = [
        np.round(robot.to_degrees(bend), DIGITS).tolist() for bend in solution.x.reshape(shape)
    ]
    bends = np.array([robot.from_degrees(bend) for bend in degrees])
    return degrees, float(asked(bends).max()) / scale
