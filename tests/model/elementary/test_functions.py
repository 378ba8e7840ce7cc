"""Elementary functions against long doubles and SciPy, in units in the last place."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
import pytest
import scipy.linalg
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from scipy import interpolate
from scipy.spatial.transform import Rotation
from scipy.special import ndtri
from strategies import RNGS

from space_robot_model.elementary.functions import arctan2, exp, log, sin_cos, sines_cosines
from space_robot_model.elementary.linear_algebra import (
    cholesky_into,
    is_positive_definite,
    move_to_side,
    principal_axes,
    solve_cholesky,
)
from space_robot_model.elementary.matrices import (
    Array,
    dot_rows,
    norm,
    norms,
    product,
    rotate_tensor,
    solve,
    unit_rows,
)
from space_robot_model.elementary.normal import normal_numbers, normal_numbers_of_one, quantile
from space_robot_model.elementary.rotations import (
    exact_sines_cosines,
    plain_sin_cos,
    rotation_of_rpy,
    rpy_of_rotation,
)
from space_robot_model.elementary.splines import CubicSpline

# Elementary functions against long doubles and SciPy, in units in the last place

RNG = np.random.default_rng(5)
quantiles = np.vectorize(quantile, otypes=[np.float64])


def ulps(found: ArrayLike, exact: NDArray[np.longdouble]) -> float:
    """Largest error in units in the last place."""
    return float(np.max(np.abs(found - exact) / np.spacing(np.abs(exact).astype(np.float64))))


@pytest.mark.parametrize(
    "angles",
    [
        *(RNG.uniform(-largest, largest, 300) for largest in (0.8, 7.0, 1e3, 1.6e6)),
        0.5 * math.pi * np.concatenate((np.arange(1, 40), RNG.integers(40, 1_000_000, 100))),
    ],
)
def test_sine_and_cosine_up_to_their_last_place(angles: NDArray[np.float64]) -> None:
    """Beside the quarter turns, too."""
    exact = angles.astype(np.longdouble)
    for found, wanted in zip(sines_cosines(angles), (np.sin(exact), np.cos(exact)), strict=True):
        assert ulps(found, wanted) < 0.8


def test_sine_and_cosine_beyond_are_those_of_an_angle_as_near_as_its_neighbours() -> None:
    x = 10.0 ** RNG.uniform(6.3, 15.0, 200)
    sine, cosine = sines_cosines(x)
    np.testing.assert_allclose(sine**2 + cosine**2, 1.0, atol=1e-15)
    assert (np.abs(sine - np.sin(x.astype(np.longdouble))) < np.spacing(x) + 1e-15).all()


def test_plain_and_compiled_sine_have_the_same_bits() -> None:
    for x in (*RNG.uniform(-4.0, 4.0, 50), *RNG.uniform(-1e7, 1e7, 50)):
        assert plain_sin_cos(float(x)) == sin_cos(x)


def test_arrays_have_the_bits_of_their_numbers() -> None:
    angles = RNG.uniform(-4.0, 4.0, (2, 3))
    sines, cosines = sines_cosines(angles)
    assert sines.shape == cosines.shape == angles.shape
    assert sin_cos(angles[1, 2]) == (sines[1, 2], cosines[1, 2])


@pytest.mark.parametrize(
    ("function", "oracle", "numbers"),
    [
        (exp, np.exp, RNG.uniform(-700.0, 709.0, 500)),
        (exp, np.exp, RNG.uniform(-1.0, 1.0, 500)),
        (log, np.log, RNG.uniform(0.0, 3.0, 500)),
        (log, np.log, 10.0 ** RNG.uniform(-320.0, 300.0, 500)),
        (log, np.log, 1.0 + RNG.normal(size=500) * 1e-6),
    ],
)
def test_exponential_and_logarithm_up_to_their_last_place(
    function: Callable[[float], float], oracle: np.ufunc, numbers: NDArray[np.float64]
) -> None:
    found = [function(float(x)) for x in numbers]
    assert ulps(found, oracle(numbers.astype(np.longdouble))) < 0.9


def test_what_is_no_number_is_as_in_the_c_library() -> None:
    with np.errstate(all="ignore"):
        for x in (-math.inf, -750.0, -745.13, 0.0, 709.78, 709.79, math.inf, math.nan):
            np.testing.assert_allclose(exp(x), np.exp(x), rtol=1e-15, err_msg=str(x))
        for x in (-1.0, 0.0, 5e-324, 1.0, math.inf, math.nan):
            np.testing.assert_allclose(log(x), np.log(x), rtol=1e-15, err_msg=str(x))
        found = quantiles([0.0, 0.5, 1.0, -0.1, 1.1, math.nan])
    for x in (-math.inf, math.inf, math.nan):
        assert np.isnan(sin_cos(x)).all()
    np.testing.assert_array_equal(found, [-np.inf, 0.0, np.inf, np.nan, np.nan, np.nan])


def test_the_normal_distribution_is_scipys() -> None:
    shares = np.concatenate((RNG.uniform(size=2000), 10.0 ** RNG.uniform(-300, -1, 2000)))
    np.testing.assert_allclose(quantiles(shares), ndtri(shares), rtol=4e-15)


@given(st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1), st.integers(0, 2**32 - 1))
def test_normal_numbers_are_those_of_numpys_generator(seed: int, key: int, block: int) -> None:
    bits = np.random.PCG64((seed, key, block)).random_raw(48)
    shares = ((bits >> np.uint64(12)).astype(float) + 0.5) * 2.0**-52
    draws = np.empty((8, 6))
    normal_numbers(draws, float(seed), key, block)
    np.testing.assert_array_equal(draws.ravel(), quantiles(shares))
    one_by_one = np.empty((8, 6))
    normal_numbers_of_one(one_by_one, float(seed), key, block)
    np.testing.assert_array_equal(one_by_one, draws)


@given(RNGS, st.integers(1, 7), st.integers(0, 3))
def test_products_are_numpys(rng: np.random.Generator, size: int, columns: int) -> None:
    """Of vectors, matrices and stacks; a length; a tensor on other axes."""
    a, b = rng.normal(size=(4, 3, size)), rng.normal(size=(size, columns) if columns else size)
    for left in (a, a[0], a[0, 0]):
        np.testing.assert_allclose(product(left, b), left @ b, rtol=0.0, atol=1e-13)
    assert norm(a[0]) == pytest.approx(np.linalg.norm(a[0]), rel=1e-14)
    tensor = rng.normal(size=(size, size))
    expected = a[0] @ tensor @ a[0].T
    np.testing.assert_allclose(rotate_tensor(a[0], tensor), expected, rtol=0.0, atol=1e-12)


@settings(max_examples=60)
@given(RNGS, st.integers(1, 7))
def test_equations_are_solved_as_exactly_as_their_condition_lets(
    rng: np.random.Generator, size: int
) -> None:
    """Columns whose largest number is negative, tiny pivots, and none."""
    matrix = rng.normal(size=(size, size))
    matrix[np.diag_indices(size)] *= rng.choice([0.0, 1e-14, 1.0], size)
    matrix[:, 0] = -np.abs(matrix[:, 0])
    matrix[0, 0] = 1e-15
    if size == 1 or np.linalg.cond(matrix) > 1e6:
        matrix += 10.0 * np.eye(size)[::-1]
    right = rng.normal(size=(size, 2))
    kept = matrix.copy(), right.copy()
    expected = np.linalg.solve(matrix, right)
    bound = 1e-14 * np.linalg.cond(matrix) * np.abs(expected).max()
    np.testing.assert_allclose(solve(matrix, right), expected, rtol=0.0, atol=bound)
    np.testing.assert_allclose(solve(matrix, right[:, 0]), expected[:, 0], rtol=0.0, atol=bound)
    np.testing.assert_array_equal(matrix, kept[0])
    np.testing.assert_array_equal(right, kept[1])


@settings(max_examples=40)
@given(RNGS, st.integers(1, 5), st.booleans())
def test_principal_axes_diagonalise(
    rng: np.random.Generator, size: int, has_equal_ones: bool
) -> None:
    """Values rise and are NumPy's; the axes are orthonormal, and those of the values."""
    values = 10.0 ** rng.uniform(-3.0, 3.0, size)
    if has_equal_ones:
        values[:2] = values[0]
    turn = np.linalg.qr(rng.normal(size=(size, size)))[0]
    tensor = turn @ np.diag(values) @ turn.T
    found, axes = principal_axes(tensor)
    scale = values.max()
    np.testing.assert_allclose(found, np.sort(values), rtol=0.0, atol=1e-13 * scale)
    np.testing.assert_allclose(axes.T @ axes, np.eye(size), rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(axes @ np.diag(found) @ axes.T, tensor, atol=1e-12 * scale)


@given(RNGS, st.integers(1, 7))
def test_rows_have_the_norms_of_vectors(rng: np.random.Generator, size: int) -> None:
    """Each row's is that of the vector alone, bit for bit; a row divided by it has length 1."""
    rows, others = rng.normal(size=(2, 5, size))
    assert norms(rows).tolist() == [norm(row) for row in rows]
    np.testing.assert_allclose(norms(unit_rows(rows)), 1.0, rtol=1e-15)
    expected = np.einsum("ij,ij->i", rows, others)
    np.testing.assert_allclose(dot_rows(rows, others)[:, 0], expected, rtol=0.0, atol=1e-13)


@given(RNGS)
def test_angles_in_all_quarters_are_the_c_librarys(rng: np.random.Generator) -> None:
    """Also along the axes, with zeros of either sign; NaN of what is not finite."""
    y, x = rng.normal(size=(2, 2, 3)) * 10.0 ** rng.uniform(-8, 8, (2, 2, 3))
    np.testing.assert_allclose(arctan2(y, x), np.arctan2(y, x), rtol=1e-15)
    sides = np.array([-1.0, -0.0, 0.0, 1.0])
    y, x = np.meshgrid(sides, sides)
    found, expected = arctan2(y, x), np.arctan2(y, x)
    np.testing.assert_allclose(found, expected, rtol=1e-15)
    np.testing.assert_array_equal(np.signbit(found), np.signbit(expected))
    assert np.isnan(arctan2([np.nan, np.inf, 1.0], [1.0, 1.0, -np.inf])).all()


@given(RNGS, st.sampled_from([None, 0.5 * np.pi, -0.5 * np.pi, 0.5 * np.pi - 1e-9]))
def test_roll_pitch_and_yaw_are_scipys(rng: np.random.Generator, pitch: float | None) -> None:
    """There and back; where pitch is a right angle the yaw is 0."""
    rpy = rng.uniform(-np.pi, np.pi, 3) * [1.0, 0.49, 1.0]
    if pitch is not None:
        rpy[1] = pitch
    rotation = rotation_of_rpy(rpy)
    expected = Rotation.from_euler("xyz", rpy).as_matrix()
    np.testing.assert_allclose(rotation, expected, rtol=0.0, atol=2e-15)
    back = rpy_of_rotation(rotation)
    np.testing.assert_allclose(rotation_of_rpy(back), rotation, rtol=0.0, atol=1e-14)
    if pitch is None:
        np.testing.assert_allclose(back, rpy, rtol=0.0, atol=1e-12)
    elif abs(pitch) == 0.5 * np.pi:
        assert back[2] == 0.0


def test_right_angles_are_exact() -> None:
    sines, cosines = exact_sines_cosines(0.5 * np.pi * np.arange(-4, 5).reshape(3, 3))
    np.testing.assert_array_equal(sines, [[0, 1, 0], [-1, 0, 1], [0, -1, 0]])
    np.testing.assert_array_equal(cosines, [[1, 0, -1], [0, 1, 0], [-1, 0, 1]])
    assert exact_sines_cosines(1e-9)[0] == 1e-9


def positive(rng: np.random.Generator, size: int) -> Array:
    """A symmetric positive definite matrix with rows of very different size, as of a robot."""
    root = rng.normal(size=(size, size))
    scale = 10.0 ** rng.uniform(-2.0, 2.0, size)
    matrix: Array = scale[:, None] * (root @ root.T + np.eye(size)) * scale
    return 0.5 * (matrix + matrix.T)


@given(RNGS, st.integers(1, 10))
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


def symmetric(rng: np.random.Generator, size: int) -> Array:
    matrix = rng.normal(size=(size, size))
    return matrix + matrix.T


@given(RNGS, st.integers(1, 8))
def test_definite_matrices_have_positive_eigenvalues(rng: np.random.Generator, size: int) -> None:
    matrix = symmetric(rng, size) + rng.uniform(0.0, 8.0) * np.eye(size)
    expected = np.linalg.eigvalsh(matrix)[0] > 0.0
    assert bool(is_positive_definite(matrix.copy())) == expected


@given(RNGS, st.integers(1, 8), st.sampled_from([1.0, -1.0]))
def test_move_is_the_projection_onto_the_cone(
    rng: np.random.Generator, size: int, side: float
) -> None:
    matrix, bound, root = symmetric(rng, size), symmetric(rng, size), rng.normal(size=(size, size))
    metric = root @ root.T + 0.1 * np.eye(size)
    values, vectors = scipy.linalg.eigh(side * (matrix - bound), metric)
    along = metric @ vectors
    expected = matrix + side * (along * np.maximum(-values, 0.0)) @ along.T
    actual, root = matrix.copy(), np.linalg.cholesky(metric)
    work, axes = np.zeros((2, size, size))
    move_to_side(actual, bound, side, root, work, axes)
    scale = np.abs(expected).max() + np.abs(bound).max()
    np.testing.assert_allclose(actual, expected, rtol=0, atol=1e-9 * scale)
    if values[0] > 0.0:
        np.testing.assert_array_equal(actual, matrix)


@given(st.integers(2, 40), st.integers(1, 5), st.integers(0, 2**31 - 1))
@settings(deadline=None)
def test_clamped_splines_are_scipys(knots: int, size: int, seed: int) -> None:
    rng = np.random.default_rng(seed)
    times = np.cumsum(rng.uniform(0.05, 1.0, knots))
    values, ends = rng.normal(size=(knots, size)), rng.normal(size=(2, size))
    ours = CubicSpline(times, values, *ends)
    theirs = interpolate.CubicSpline(times, values, bc_type=((1, ends[0]), (1, ends[1])))
    at = np.sort(rng.uniform(times[0], times[-1], 50))
    rows = ours.at(at)
    for order in range(3):
        expected = theirs(at, order)
        scale = max(1.0, float(np.max(np.abs(expected))))
        np.testing.assert_allclose(rows[:, order], expected, rtol=0.0, atol=1e-10 * scale)


def test_outside_its_times_a_spline_rests_at_the_nearer_end() -> None:
    spline = CubicSpline(np.array([1.0, 2.0]), np.array([[1.0], [3.0]]), 1.0, 1.0)
    np.testing.assert_array_equal(
        spline.at(np.array([0.0, 5.0]))[:, :, 0], [[1.0, 0.0, 0.0], [3.0, 0.0, 0.0]]
    )
