"""Where Python and C differ, a translated kernel does what Numba makes of the kernel."""

from __future__ import annotations

import ctypes
import importlib.util
import math
from collections.abc import Callable
from functools import cache
from itertools import product
from pathlib import Path, PurePosixPath
from typing import Any

import jinja2
import numpy as np
import pytest
import yaml
from exported_kernels import needs_compiler
from hypothesis import example, given
from hypothesis import strategies as st
from paths import DATA

from space_robot_control.flight_code.c99.language import (
    BOOL,
    FLOAT,
    INT,
    ArrayOf,
    NotInSubsetError,
    Value,
)
from space_robot_control.flight_code.c99.program import KernelProgram
from space_robot_control.flight_code.files import Files
from space_robot_control.flight_code.folder import FLAGS, WARNINGS
from space_robot_control.flight_code.instances import build_library
from space_robot_model.elementary.functions import sin_cos
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, where, whole

pytestmark = needs_compiler
SPECIAL = [0.0, -0.0, 1.0, -1.0, math.nan, math.inf, -math.inf, 5e-324, 1.7e308]
floats = st.one_of(st.sampled_from(SPECIAL), st.floats())
integers = st.integers(-(2**52), 2**52)
CTYPES = {FLOAT: ctypes.c_double, INT: ctypes.c_int64, BOOL: ctypes.c_bool}


def text_of(*signatures: tuple[Any, ...]) -> str:
    """The C of kernels, each with the types of its arguments, and of all that they call."""
    program = KernelProgram({}, 3)
    functions = []
    for function, *kinds in signatures:
        values = tuple(Value(kind, "given") for kind in kinds)
        functions.append(program.functions[program.function(function.py_func, values)])
    files = Files(program, functions, [], lambda _: "all")
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("space_robot_control.flight_code"), autoescape=False
    )
    header = environment.get_template("kernels.h.j2").render(
        constants=files.constants(), tuples=files.tuples(), prototypes=files.prototypes()
    )
    header = header.replace(
        '#include "space_robot_flight.h"', "#include <stdbool.h>\n#include <stdint.h>"
    )
    return files.final(header) + files.rooms()["all"]


def in_c(*signatures: tuple[Any, ...]) -> dict[Any, Callable[..., Any]]:
    """Kernels by themselves, compiled together by the system's compiler; arrays are float64."""
    text = text_of(*signatures)
    flags = (*FLAGS, *WARNINGS, "-Wno-unused-function")
    compiled = ctypes.CDLL(str(build_library({PurePosixPath("kernel.c"): text}, flags)))
    return {one: call_of(compiled, one, kinds) for one, *kinds in signatures}


def call_of(compiled: ctypes.CDLL, original: Any, kinds: list[Any]) -> Callable[..., Any]:
    function = getattr(compiled, f"sr_{original.py_func.__name__.lstrip('_')}")
    result = original.py_func.__annotations__["return"]
    function.restype = {"float": ctypes.c_double, "int": ctypes.c_int64, "None": None}[result]

    def call(*arguments: Any) -> Any:
        given = []
        for kind, argument in zip(kinds, arguments, strict=True):
            if isinstance(argument, np.ndarray):
                given.append(ctypes.c_void_p(argument.ctypes.data))
            else:
                given.append(CTYPES[kind](argument))
        return function(*given)

    return call


def same_bits(one: float, other: float) -> bool:
    """Whether two floats have the same bits; any NaN is as good as another."""
    if one != one:
        return other != other
    return np.float64(one).tobytes() == np.float64(other).tobytes()


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
def mixed(a: int, b: float) -> float:
    c = 0
    if b > 0.0:
        c = a
    d = c + b
    e = 1
    e += a
    return d * e + (1 << (e & 7)) + (a >> 2)


@kernel
def sine(angle: float) -> float:
    pair = sin_cos(angle)
    return pair[0] + 3.0 * pair[1]


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
def whole_of(a: float) -> int:
    return int(a)


SCALARS: tuple[Any, ...] = (
    *(extremes, greatest, least, sign, modulo, quotient, divided, compared, chosen),
    *(contracted, associated, mixed, sine, truncated, whole_of),
)
KINDS = {"float": FLOAT, "int": INT, "bool": BOOL}
ARRAYS: dict[Any, tuple[Any, ...]] = {
    exchanged: (ArrayOf((4,)),),
    ordered: (ArrayOf((4,)),),
    loops: (ArrayOf((4,)), INT),
    parts: (ArrayOf((7,)), ArrayOf((4,))),
    matrices: (ArrayOf((2, 3)), ArrayOf((3, 3))),
}


def words_of(function: Any) -> list[str]:
    """The types of its arguments."""
    return list(function.py_func.__annotations__.values())[:-1]


@cache
def library() -> dict[Any, Any]:
    scalars = ((function, *(KINDS[word] for word in words_of(function))) for function in SCALARS)
    return in_c(*scalars, *((function, *kinds) for function, kinds in ARRAYS.items()))


def assert_same(function: Any, *arguments: Any) -> None:
    """The result, and all that has been written, of copies."""
    python, c = (
        [a.copy() if isinstance(a, np.ndarray) else a for a in arguments] for _ in range(2)
    )
    one, other = function(*python), library()[function](*c)
    assert one is other is None or same_bits(one, other), (function.__name__, arguments)
    for mine, theirs in zip(python, c, strict=True):
        np.testing.assert_array_equal(mine, theirs)


def fits(function: Any, numbers: list[float]) -> bool:
    """Whether these can be cut to integers, and be the angle of a sine."""
    if function in (truncated, whole_of):
        return abs(numbers[0]) < 4e18
    return function is not sine or abs(numbers[0]) < 1e9


@given(st.lists(floats, min_size=3, max_size=3), st.tuples(integers, integers), st.booleans())
@example([4.5, -4.5, 0.5], (-7, 3), True)
@example([-4.5, 1e9, 1e-9], (7, -3), False)
@example([0.0] * 3, (-(2**52), -1), False)
@example([0.0] * 3, (5, 0), False)
def test_scalars(numbers: list[float], whole_numbers: tuple[int, int], flag: bool) -> None:
    for function in SCALARS:
        if fits(function, numbers):
            given = {"float": iter(numbers), "int": iter(whole_numbers), "bool": iter([flag])}
            assert_same(function, *(next(given[word]) for word in words_of(function)))
    a, b = whole_numbers
    if b:
        assert library()[modulo](a, b) == a % b
        assert library()[quotient](a, b) == a // b


@pytest.mark.parametrize("function", [greatest, least, sign, compared], ids=lambda f: f.__name__)
def test_special_numbers_meet(function: Any) -> None:
    for a, b in product(SPECIAL, SPECIAL):
        assert_same(function, a, b)


@pytest.mark.parametrize("a", [math.nan, math.inf, -math.inf, 9.3e18, -1e300])
def test_a_float_without_integer_gives_the_least_one(a: float) -> None:
    """As this processor's instruction does, which Numba takes; in C it would be undefined."""
    assert library()[whole_of](a) == -(2**63)


@given(st.lists(st.floats(-5.0, 5.0), min_size=4, max_size=4), st.integers(0, 6))
def test_statements(values: list[float], count: int) -> None:
    """Slices are places in the same memory, matrices have rows."""
    for function in (exchanged, ordered):
        assert_same(function, np.array(values))
    assert_same(loops, np.array(values), count)
    assert_same(parts, np.arange(1.0, 8.0), np.array(values))
    assert_same(matrices, np.arange(6.0).reshape(2, 3), np.arange(9.0).reshape(3, 3))


@kernel
def bound(a: float, is_used: bool) -> float:
    if not is_used:
        return a
    return where(is_used, 2.0 * a, 3.0 * a)


def test_what_was_asked_is_not_asked_again_and_an_integer_stays_one() -> None:
    text = text_of((bound, FLOAT, BOOL), (quotient, INT, INT))
    assert "return 2.0 * a;" in text
    assert "3.0" not in text
    assert "int64_t a" in text


# What has no translation


ROWS: list[dict[str, Any]] = yaml.safe_load((DATA / "refusals/flight_code.yaml").read_text("utf-8"))
HEAD = """
import numpy as np

from space_robot_msgs_py.compiled.kernels import kernel


@kernel
def written(values):
    values[0] += 1.0
    return values[0]


@kernel
def kernel_under_test(a, row):
"""


@pytest.mark.parametrize("row", ROWS, ids=lambda row: row["construct"])
def test_a_construct_is_refused_with_file_line_and_what_to_write(
    row: dict[str, Any], tmp_path: Path
) -> None:
    path = tmp_path / "refused.py"
    path.write_text(HEAD + "".join(f"    {line}\n" for line in row["body"]))
    spec = importlib.util.spec_from_file_location("refused", path)
    assert spec
    assert spec.loader
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    with pytest.raises(NotInSubsetError) as error:
        text_of((module.kernel_under_test, FLOAT, ArrayOf((4,))))
    line = HEAD.count("\n") + row.get("line", len(row["body"]))
    assert str(error.value).startswith(f"{path}, line {line}: ")
    for part in (row["construct"], " cannot be exported as C: ", row["instead"]):
        assert part in str(error.value)
    assert "\n" not in str(error.value)
