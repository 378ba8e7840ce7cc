"""What has no translation to C is refused in one line: file, line, construct, what to write."""

from __future__ import annotations

import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_kernels import text_of
from numpy.typing import NDArray

from space_robot_control.flight_code.c99.language import FLOAT, INT, ArrayOf, NotInSubsetError
from space_robot_msgs_py.compiled.kernels import kernel

Array = NDArray[np.float64]
ROW = ArrayOf((4,))


@kernel
def exponential(a: float) -> float:
    return np.exp(a)  # differs between machines


@kernel
def caught(a: float) -> float:
    try:
        return a
    except ValueError:
        return 0.0


@kernel
def listed(a: float) -> float:
    return sum([a, a])


@kernel
def power(a: float) -> float:
    return a**3


@kernel
def remainder(a: float) -> float:
    return a % 2.0


@kernel
def stepped(values: Array) -> float:
    return values[::2][0]


@kernel
def negative(values: Array) -> float:
    return values[-1]


@kernel
def allocated(a: float) -> float:
    return np.zeros(3)[0] + a


@kernel
def counter_read(values: Array) -> int:
    for i in range(3):
        values[i] = 0.0
    return i


@kernel
def counter_set(values: Array) -> None:
    for i in range(3):
        values[i] = 0.0
        i = 2


@kernel
def reserved(a: float) -> float:
    double = 2.0 * a
    return double


@kernel
def two_types(a: float, values: Array) -> float:
    b = a
    if a > 0.0:
        b = values
    return a + b


@kernel
def _written(values: Array) -> float:
    values[0] += 1.0
    return values[0]


@kernel
def unordered(values: Array) -> float:
    return _written(values) * values[0]


@kernel
def starred(values: Array) -> float:
    return max(*values)


@kernel
def recursive(a: float) -> float:
    return recursive(a - 1.0) if a > 0.0 else a


@pytest.mark.parametrize(
    ("function", "kinds", "what", "instead"),
    [
        (exponential, [FLOAT], "a call of np.exp()", "exact functions"),
        (caught, [FLOAT], "try", "use if, for and while"),
        (listed, [FLOAT], "List", "plain arithmetic"),
        (power, [FLOAT], "the operator Pow", "write products out"),
        (remainder, [FLOAT], "a remainder of floats", "np.floor"),
        (stepped, [ROW], "a slice that is not of neighbouring numbers", "copy them in a loop"),
        (negative, [ROW], "the index -1", "an integer from 0 on"),
        (allocated, [FLOAT], "a call of np.zeros()", "exact functions"),
        (counter_read, [ROW], "'i' outside of its loop", "another name"),
        (counter_set, [ROW], "'i' set beside its loop", "another name"),
        (reserved, [FLOAT], "the name 'double'", "another one"),
        (two_types, [FLOAT, ROW], "one name for a float and an array", "a name for each type"),
        (unordered, [ROW], "a kernel that writes, beside other values", "name its result first"),
        (starred, [ROW], "a call with keywords or a star", "by position"),
        (recursive, [FLOAT], "recursion", "write a loop"),
    ],
    ids=lambda value: getattr(value, "__name__", ""),
)
def test_a_construct_is_refused(function: Any, kinds: list[Any], what: str, instead: str) -> None:
    with pytest.raises(NotInSubsetError) as error:
        text_of(function, *kinds)
    text = str(error.value)
    assert "\n" not in text
    assert what in text
    assert instead in text
    match = re.fullmatch(r"(.+\.py), line (\d+): .+ cannot be exported as C: .+", text)
    assert match is not None
    assert Path(match[1]).name == Path(__file__).name
    code = function.py_func.__code__
    last = code.co_firstlineno + len(list(code.co_lines()))
    assert code.co_firstlineno <= int(match[2]) <= last


@kernel
def wrong_place(a: float) -> float:
    b = 2.0 * a
    c = b + 1.0
    return np.cos(c)


def test_the_line_is_that_of_the_construct() -> None:
    with pytest.raises(NotInSubsetError) as error:
        text_of(wrong_place, FLOAT)
    line = wrong_place.py_func.__code__.co_firstlineno + 4
    assert f"line {line}: " in str(error.value)


def test_an_integer_parameter_stays_one() -> None:
    assert "int64_t a" in text_of(whole, INT)


@kernel
def whole(a: int) -> int:
    return a + 1
