"""Cholesky factorisation in kernels beside NumPy's, alone and in lanes."""

from __future__ import annotations

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

from space_robot_model.elementary.cholesky import cholesky_into, solve_cholesky
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lane_words import as_lanes
from space_robot_msgs_py.compiled.lanes import WIDTH

Array = NDArray[np.float64]

seeds = st.integers(0, 2**32 - 1).map(np.random.default_rng)


def positive(rng: np.random.Generator, size: int) -> Array:
    """A symmetric positive definite matrix with rows of very different size, as of a robot."""
    root = rng.normal(size=(size, size))
    scale = 10.0 ** rng.uniform(-2.0, 2.0, size)
    matrix: Array = scale[:, None] * (root @ root.T + np.eye(size)) * scale
    return 0.5 * (matrix + matrix.T)


@given(seeds, st.integers(1, 10))
def test_factor_and_solution_are_those_of_numpy(rng: np.random.Generator, size: int) -> None:
    """The upper triangles are neither read nor written, and the matrix stays."""
    matrix, right = positive(rng, size), rng.normal(size=size)
    spoiled = np.tril(matrix) + np.triu(np.full((size, size), np.nan), 1)
    kept, factor = spoiled.copy(), np.full((size, size), np.nan)
    cholesky_into(spoiled, 0, factor)
    np.testing.assert_array_equal(spoiled, kept)
    assert np.isnan(factor[np.triu_indices(size, 1)]).all()
    lower = np.tril(np.nan_to_num(factor))
    scale = np.sqrt(np.diag(matrix))
    units = scale[:, None]
    np.testing.assert_allclose(lower / units, np.linalg.cholesky(matrix) / units, atol=1e-12)
    solution = right.copy()
    solve_cholesky(factor, solution)
    # rows and columns scaled to a diagonal of ones, as the condition number then says
    correlation = matrix / np.outer(scale, scale)
    error = scale * (solution - np.linalg.solve(matrix, right))
    condition = np.linalg.cond(correlation)
    size_of = np.abs(scale * solution).max()
    assert np.abs(error).max() <= 1e-14 * size * condition * (size_of + np.abs(right / scale).max())


@given(seeds, st.integers(1, 7))
def test_a_block_of_a_matrix_is_solved_in_place(rng: np.random.Generator, size: int) -> None:
    """As for the joints' part of an inertia and of an acceleration."""
    matrix, right = positive(rng, size + 3), rng.normal(size=size + 3)
    factor, whole = np.zeros((size, size)), right.copy()
    cholesky_into(matrix, 3, factor)
    solve_cholesky(factor, whole[3:])
    np.testing.assert_array_equal(whole[:3], right[:3])
    residual = matrix[3:, 3:] @ whole[3:] - right[3:]
    size_of = np.abs(matrix[3:, 3:]) @ np.abs(whole[3:]) + np.abs(right[3:])
    np.testing.assert_array_less(np.abs(residual), 1e-13 * size_of)


@kernel
def _solve_in_lanes(matrices: Array, factors: Array, rights: Array) -> None:
    factor = as_lanes(factors)
    cholesky_into(as_lanes(matrices), 0, factor)
    solve_cholesky(factor, as_lanes(rights))


@given(seeds, st.integers(1, 7))
def test_every_lane_has_the_bits_of_one_alone(rng: np.random.Generator, size: int) -> None:
    matrices = np.stack([positive(rng, size) for _ in range(WIDTH)], axis=-1)
    rights = rng.normal(size=(size, WIDTH))
    solutions, factors = rights.copy(), np.zeros_like(matrices)
    _solve_in_lanes(np.ascontiguousarray(matrices), factors, solutions)
    for lane in range(WIDTH):
        alone, factor = rights[:, lane].copy(), np.zeros((size, size))
        cholesky_into(np.ascontiguousarray(matrices[..., lane]), 0, factor)
        solve_cholesky(factor, alone)
        np.testing.assert_array_equal(solutions[:, lane], alone)
        np.testing.assert_array_equal(factors[..., lane], factor)
