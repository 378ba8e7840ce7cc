"""Inertias in files: conversion, and checks of physical consistency."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

Array = NDArray[np.float64]


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
InertiaElements = Annotated[list[InertiaElement], Field(min_length=6, max_length=6)]
Inertia = Annotated[InertiaElements, AfterValidator(check_inertia)]
