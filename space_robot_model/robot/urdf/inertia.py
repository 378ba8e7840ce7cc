"""Check of the physical consistency of inertias, and the nearest consistent inertia."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from ...elementary.matrices import rotate_tensor
from ..tree import Visual

Array = NDArray[np.float64]

LEAST_GYRATION = 1e-6
"""Radius of gyration below which a body counts as a point, m."""
ROUNDING = 1e-9
"""Relative tolerance of the triangle inequality of principal moments."""
SLENDER = 1e-3
"""Smallest second moment of a repaired body relative to the largest: a rod of 1 m is then 4 cm
thick."""
SOLID = 1000.0
"""Assumed density of a body of unknown shape, kg/m3."""


def inertia_defect(mass: float, inertia: Array) -> tuple[str, str]:
    """Return the description of an inconsistent inertia, and its principal moments.

    Args:
        mass: kg, above 0.
        inertia: (3, 3) about the CoM, kg m2.

    Returns:
        The defect, empty if there is none, and the moments, kg m2, as text.
    """
    moments = np.linalg.eigvalsh(inertia)
    listed = ", ".join(f"{moment:.4g}" for moment in moments)
    if np.max(np.abs(moments)) <= mass * LEAST_GYRATION**2:
        return "the inertia is zero", listed
    if moments[0] <= ROUNDING * moments[2]:
        return "the inertia is not positive definite (principal moments)", listed
    if moments[2] > (moments[0] + moments[1]) * (1.0 + ROUNDING):
        return "the inertia breaks the triangle inequality (principal moments)", listed
    return "", listed


def nearest_inertia(inertia: Array) -> Array | None:
    """Return the nearest physically consistent inertia; None if there is nothing near.

    A body's second moments ``S = integral r r^T dm = 1/2 tr(I) 1 - I`` are positive semidefinite,
    and every such matrix belongs to a body (Wensing, Kim and Slotine 2018, Linear matrix
    inequalities for physically consistent inertial parameter identification). The nearest such
    matrix has the negative eigenvalues raised to 0 (Higham 1988), here to a little above.
    """
    from ...elementary.linear_algebra import principal_axes  # numba: slow to import

    moments, axes = principal_axes(inertia)
    second = 0.5 * np.sum(moments) - moments
    largest = float(np.max(second))
    if largest <= 0.0:
        return None
    second = np.maximum(second, SLENDER * largest)
    nearest = rotate_tensor(axes, np.diag(np.sum(second) - second))
    return 0.5 * (nearest + nearest.T)


def solid_inertia(mass: float, visuals: tuple[Visual, ...]) -> tuple[Array, str]:
    """Return the inertia, kg m2, of a homogeneous body with the first shape, and its description.

    Without a shape it is a sphere with the density of water.

    Args:
        mass: kg.
        visuals: shapes of the body; meshes are ignored.
    """
    for visual in visuals:
        if visual.shape != "mesh":
            turn = visual.rotation
            inertia: Array = rotate_tensor(turn, np.diag(_solid(mass, visual.shape, visual.size)))
            return inertia, f"the solid {visual.shape} of its visual"
    from ...elementary.functions import exp, log  # slow to import

    radius = exp(log(3.0 * mass / (4.0 * math.pi * SOLID)) / 3.0)
    ball = _solid(mass, "sphere", (radius,))
    return np.diag(ball), f"a solid sphere of {radius:.3g} m (density of water)"


def _solid(mass: float, shape: str, size: tuple[float, ...]) -> list[float]:
    """Return the principal moments of a homogeneous solid, kg m2, in its axes."""
    if shape == "sphere":
        return [0.4 * mass * size[0] * size[0]] * 3
    if shape == "cylinder":
        radius, length = size
        across = mass * (3.0 * radius * radius + length * length) / 12.0
        return [across, across, 0.5 * mass * radius * radius]
    x, y, z = (mass * edge * edge / 12.0 for edge in size)
    return [y + z, x + z, x + y]
