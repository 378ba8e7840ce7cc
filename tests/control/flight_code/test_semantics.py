"""Where Python and C differ, a translated kernel does what Numba makes of the kernel."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from exported_kernels import in_c, needs_compiler, same_bits, text_of
from hypothesis import example, given
from hypothesis import strategies as st
from numpy.typing import NDArray

from space_robot_control.flight_code.c99.language import BOOL, FLOAT, INT, ArrayOf
from space_robot_model.elementary.sine import sin_cos
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, where, whole

Array = NDArray[np.float64]
pytestmark = needs_compiler

floats = st.one_of(
    st.sampled_from([0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 5e-324, 1.7e308]),
    st.floats(),
)
integers = st.integers(-(2**52), 2**52)


@kernel
def extremes(a: float, b: float, c: float) -> float:
    return max(a, b, c) - 3.0 * min(a, b) + 5.0 * min(max(c, -1.0), 1.0)


@kernel
def greatest(a: float, b: float) -> float:
    return max(a, b)


@kernel
def least(a: float, b: float) -> float:
    return min(a, b)


@kernel
def sign(a: float, b: float) -> float:
    return np.sign(a) * math.copysign(2.0, b)


@kernel
def modulo(a: int, b: int) -> int:
    return a % b


@kernel
def quotient(a: int, b: int) -> int:
    return a // b


@kernel
def truncated(a: float) -> int:
    return int(a) + whole(0.5 * a)


@kernel
def divided(a: int, b: int) -> float:
    return a / b


@kernel
def compared(a: float, b: float) -> int:
    return (
        int(a < b)
        + 2 * int(a <= b)
        + 4 * int(not a > b)
        + 8 * int(a == b)
        + 16 * int(a != b)
        + 32 * int(0.0 <= a < b)
        + 64 * int(np.isfinite(a))
        + 128 * int(np.isnan(b))
        + 256 * int((a > 0.0) | (b > 0.0))
        + 512 * int((a > 0.0) & (b > 0.0))
    )


@kernel
def chosen(a: float, b: float, c: bool) -> float:
    low, high = where(c, (a, b), (b, a))
    return uniform(low) - 2.0 * high if low == low else 7.0


@kernel
def contracted(a: float, b: float, c: float) -> float:
    return a * b + c - (a * c - b) * b


@kernel
def associated(a: float, b: float, c: float) -> float:
    return a - (b - c) - (a + b + c) / (a / (b * c)) * -(b - a)


@kernel
def exchanged(values: Array) -> None:
    a, b = values[0], values[1]
    a, b = b, a + b
    values[0], values[1] = a + values[1], b + values[0]
    values[2] = values[3] = a * b


@kernel
def parts(values: Array, other: Array) -> None:
    middle = values[2:5]
    other[1:] = middle
    middle[:] = 0.0
    values[:2] = other[1:3]
    middle[1] += other.size
    for _ in range(2):
        middle[2] -= 0.5


@kernel
def loops(values: Array, count: int) -> float:
    total, k = 0.0, 0
    for i in range(values.size - 1, -1, -1):
        if values[i] < 0.0:
            continue
        total = 0.5 * total + values[i]
    for i in range(min(count, 4)):
        if i == 3:
            break
        count -= 1
        total += i * values[i]
    while k < count and total < 10.0:
        total += 1.0
        k += 2
    for factor, first in ((1.0, 0), (-0.5 * total, 2)):
        total += factor * values[first]
    return total + k


@kernel
def _counted(values: Array) -> bool:
    values[3] += 1.0
    return values[3] > 2.0


@kernel
def ordered(values: Array) -> float:
    if values[0] > 0.0 and _counted(values):
        return values[3]
    if values[1] > 0.0 or _counted(values):
        return -values[3]
    return 0.5


@kernel
def matrices(a: Array, b: Array) -> None:
    row = b[1]
    for i in range(a.shape[0]):
        for j in range(a.shape[1]):
            row[j] += a[i, j] * b[0, j]
    b[2, 0] = row[0]


@kernel
def mixed(a: int, b: float) -> float:
    c = 0
    if b > 0.0:
        c = a
    d = c + b
    e = 1
    e += a
    return d * e + (1 << (e & 7)) + (a >> 2)


@pytest.mark.parametrize("function", [greatest, least, sign], ids=lambda f: f.__name__)
def test_extremes_and_signs_of_two(function: Any) -> None:
    c = in_c(function, FLOAT, FLOAT)
    special = [0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 5e-324]
    for a in special:
        for b in special:
            assert same_bits(function(a, b), c(a, b)), (a, b)


@given(floats, floats, floats)
def test_floats_of_three(a: float, b: float, c: float) -> None:
    for function in (extremes, contracted, associated):
        assert same_bits(function(a, b, c), _c(function, FLOAT, FLOAT, FLOAT)(a, b, c))


@given(integers, integers)
@example(-7, 3)
@example(7, -3)
@example(-(2**52), -1)
@example(5, 0)
def test_integers_round_as_in_python(a: int, b: int) -> None:
    assert _c(modulo, INT, INT, result=INT)(a, b) == modulo(a, b)
    assert _c(quotient, INT, INT, result=INT)(a, b) == quotient(a, b)
    assert same_bits(_c(divided, INT, INT)(a, b), divided(a, b))
    if b:
        assert modulo(a, b) == a % b
        assert quotient(a, b) == a // b


@given(st.floats(-4e18, 4e18))
def test_an_integer_is_cut_from_a_float(a: float) -> None:
    assert _c(truncated, FLOAT, result=INT)(a) == int(a) + int(0.5 * a)


@pytest.mark.parametrize("a", [math.nan, math.inf, -math.inf, 9.3e18, -1e300])
def test_a_float_without_integer_gives_the_least_one(a: float) -> None:
    """As this processor's instruction does, which Numba takes; in C it would be undefined."""
    c = in_c(whole_of, FLOAT, result=INT)
    assert c(a) == -(2**63)


@kernel
def whole_of(a: float) -> int:
    return int(a)


@given(floats, floats)
def test_comparisons(a: float, b: float) -> None:
    assert _c(compared, FLOAT, FLOAT, result=INT)(a, b) == compared(a, b)


@given(floats, floats, st.booleans())
def test_tuples_are_chosen_whole(a: float, b: float, c: bool) -> None:
    assert same_bits(_c(chosen, FLOAT, FLOAT, BOOL)(a, b, c), chosen(a, b, c))


@given(st.integers(-1000, 1000), floats)
def test_integers_become_floats_where_they_meet(a: int, b: float) -> None:
    assert same_bits(_c(mixed, INT, FLOAT)(a, b), mixed(a, b))


@pytest.mark.parametrize("function", [exchanged, loops, ordered], ids=lambda f: f.__name__)
@given(st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4), st.integers(0, 6))
def test_statements(function: Any, values: list[float], count: int) -> None:
    python, c = np.array(values), np.array(values)
    more = (count,) if function is loops else ()
    kinds = (ArrayOf((4,)), *([INT] if more else []))
    result = None if function is exchanged else FLOAT
    one, other = function(python, *more), _c(function, *kinds, result=result)(c, *more)
    assert result is None or same_bits(one, other)
    np.testing.assert_array_equal(python, c)


def test_slices_are_places_in_the_same_memory() -> None:
    arrays = [(np.arange(1.0, 8.0), np.zeros(4)) for _ in range(2)]
    parts(*arrays[0])
    in_c(parts, ArrayOf((7,)), ArrayOf((4,)), result=None)(*arrays[1])
    for python, c in zip(*arrays, strict=True):
        np.testing.assert_array_equal(python, c)


def test_matrices_have_rows() -> None:
    arrays = [(np.arange(6.0).reshape(2, 3), np.arange(9.0).reshape(3, 3)) for _ in range(2)]
    matrices(*arrays[0])
    in_c(matrices, ArrayOf((2, 3)), ArrayOf((3, 3)), result=None)(*arrays[1])
    for python, c in zip(*arrays, strict=True):
        np.testing.assert_array_equal(python, c)


@kernel
def sine(angle: float) -> float:
    pair = sin_cos(angle)
    return pair[0] + 3.0 * pair[1]


@given(st.floats(-1e9, 1e9))
def test_sine_and_cosine(angle: float) -> None:
    assert same_bits(_c(sine, FLOAT)(angle), sine(angle))


@kernel
def bound(a: float, is_used: bool) -> float:
    if not is_used:
        return a
    return where(is_used, 2.0 * a, 3.0 * a)


def test_what_was_asked_is_not_asked_again() -> None:
    text = text_of(bound, FLOAT, BOOL)
    assert "return 2.0 * a;" in text
    assert "3.0" not in text


_COMPILED: dict[Any, Any] = {}


def _c(function: Any, *kinds: Any, result: Any = FLOAT) -> Any:
    if function not in _COMPILED:
        _COMPILED[function] = in_c(function, *kinds, result=result)
    return _COMPILED[function]
