"""The nearest matrix above or below a bound, against SciPy's generalised eigenvalues."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from space_robot_model.elementary.definite import is_positive_definite, move_to_side, normalise

Array = NDArray[np.float64]
seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def symmetric(rng: np.random.Generator, size: int) -> Array:
    matrix = rng.normal(size=(size, size))
    return matrix + matrix.T


def definite(rng: np.random.Generator, size: int) -> Array:
    root = rng.normal(size=(size, size))
    return root @ root.T + 0.1 * np.eye(size)


def root_of(matrix: Array) -> Array:
    """Cholesky's factor."""
    return np.asarray(np.linalg.cholesky(matrix), np.float64)


@given(seeds, st.integers(1, 8))
def test_definite_matrices_have_positive_eigenvalues(rng: np.random.Generator, size: int) -> None:
    matrix = symmetric(rng, size) + rng.uniform(0.0, 8.0) * np.eye(size)
    expected = np.linalg.eigvalsh(matrix)[0] > 0.0
    assert bool(is_positive_definite(matrix.copy())) == expected


@given(seeds, st.integers(1, 8))
def test_normalised_matrix_is_that_on_other_axes(rng: np.random.Generator, size: int) -> None:
    matrix, root = symmetric(rng, size), root_of(definite(rng, size))
    inverse, actual = np.linalg.inv(root), matrix.copy()
    normalise(actual, root)
    expected = inverse @ matrix @ inverse.T
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-10 * np.abs(expected).max())


@given(seeds, st.integers(1, 8), st.sampled_from([1.0, -1.0]))
def test_move_is_the_projection_onto_the_cone(
    rng: np.random.Generator, size: int, side: float
) -> None:
    matrix, bound, metric = symmetric(rng, size), symmetric(rng, size), definite(rng, size)
    values, vectors = scipy.linalg.eigh(side * (matrix - bound), metric)
    along = metric @ vectors
    expected = matrix + side * (along * np.maximum(-values, 0.0)) @ along.T
    actual, root = matrix.copy(), root_of(metric)
    work, axes = np.zeros((2, size, size))
    move_to_side(actual, bound, side, root, work, axes)
    scale = np.abs(expected).max() + np.abs(bound).max()
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9 * scale)
    if values[0] > 0.0:
        np.testing.assert_array_equal(actual, matrix)
