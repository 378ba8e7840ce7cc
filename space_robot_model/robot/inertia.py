"""Inertias: conversion, checks of physical consistency, and the nearest consistent inertia."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import AfterValidator, Field

from ..elementary.matrices import Array, rotate_tensor


def inertia_tensor(values: list[float]) -> Array:
    """Return ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]``, kg m2, as a symmetric (3, 3) tensor."""
    xx, yy, zz, xy, xz, yz = values
    return np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def inertia_elements(tensors: Array) -> Array:
    """Return the six elements (..., 6) of tensors (..., 3, 3), the inverse of `inertia_tensor`."""
    t = tensors
    moments = [t[..., 0, 0], t[..., 1, 1], t[..., 2, 2]]
    return np.stack([*moments, t[..., 0, 1], t[..., 0, 2], t[..., 1, 2]], axis=-1)


def check_inertia(values: list[float]) -> list[float]:
    """Return the six elements of an inertia if it is physically consistent.

    Raises:
        ValueError: it is not positive definite, or violates the triangle inequality.
    """
    moments = np.linalg.eigvalsh(inertia_tensor(values))
    if moments[0] <= 0.0:
        raise ValueError(
            f"inertia must be positive definite, its smallest principal moment is {moments[0]:g}"
        )
    if moments[2] > (moments[0] + moments[1]) * (1.0 + 1e-9):
        raise ValueError(
            "inertia must meet the triangle inequality (no principal moment above the sum of the "
            f"other two), its principal moments are {', '.join(f'{m:g}' for m in moments)}"
        )
    return values


LARGEST_MASS, LARGEST_INERTIA = 1e20, 1e20
"""Of a body, kg and kg m2: products of larger numbers overflow."""
Mass = Annotated[float, Field(gt=0.0, le=LARGEST_MASS)]
InertiaElement = Annotated[float, Field(ge=-LARGEST_INERTIA, le=LARGEST_INERTIA)]
Inertia = Annotated[
    list[InertiaElement], Field(min_length=6, max_length=6), AfterValidator(check_inertia)
]

LEAST_GYRATION = 1e-6
"""Radius of gyration below which a body counts as a point, m."""
ROUNDING = 1e-9
"""Relative tolerance of the triangle inequality of principal moments."""
SLENDER = 1e-3
"""Smallest second moment of a repaired body relative to the largest: a rod of 1 m is then 4 cm
thick."""


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
    from ..elementary.linear_algebra import principal_axes  # slow to import

    moments, axes = principal_axes(inertia)
    # eigenvalues of S, on the same axes
    second = 0.5 * np.sum(moments) - moments
    largest = float(np.max(second))
    if largest <= 0.0:
        return None
    second = np.maximum(second, SLENDER * largest)
    nearest = rotate_tensor(axes, np.diag(np.sum(second) - second))
    # rounding has made it unsymmetric
    return 0.5 * (nearest + nearest.T)
