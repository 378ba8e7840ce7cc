"""The language of kernels (docs/explanation/kernels.md), over their syntax trees and in lanes."""

from __future__ import annotations

import ast
import math
from collections.abc import Iterator
from functools import cache
from importlib import import_module
from typing import Any, NamedTuple

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numba.core.errors import NumbaError
from paths import ROOT

from space_robot_model.elementary.functions import sin_cos
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import (
    WIDTH,
    all_lanes,
    any_lane,
    as_lanes,
    as_numbers,
    lane_of,
    negated,
    uniform,
    where,
    whole,
    with_lane,
)
from space_robot_msgs_py.compiled.records import Field, Record, nested, shaped

PACKAGES = ("space_robot", "space_robot_control", "space_robot_model", "space_robot_sim")
EXACT = {
    *("np.sqrt", "math.sqrt", "np.floor", "np.sign", "np.isnan", "np.isfinite", "math.isfinite"),
    *("math.copysign", "math.ldexp", "math.frexp", "np.fmod", "np.zeros", "np.empty", "np.eye"),
    *("np.int64", "np.uint64", "math.inf", "math.nan", "math.pi"),
}
"""What kernels use of `math` and NumPy: each gives the same bits on every processor."""
SAME_IN_FLIGHT = {"transfer_left", "tick", "seen", "is_active", "pair_is_as_measured"}
"""Fields that change in flight, in all lanes alike."""


class Source(NamedTuple):
    """A compiled function."""

    file: str
    tree: ast.FunctionDef

    def __str__(self) -> str:
        return f"{self.file}:{self.tree.lineno} {self.tree.name}"


@cache
def kernels() -> list[Source]:
    return list(_sources())


def _sources() -> Iterator[Source]:
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.FunctionDef) and any(
                    isinstance(d, ast.Name) and d.id in ("kernel", "subroutine")
                    for d in node.decorator_list
                ):
                    yield Source(str(path.relative_to(ROOT)), node)


def uniform_fields() -> set[str]:
    """Names of all fields declared as uniform."""
    for package in PACKAGES[1:]:
        for path in (ROOT / package).rglob("*.py"):
            if "Record" in path.read_text("utf-8"):
                import_module(".".join(path.relative_to(ROOT).with_suffix("").parts))
    waiting, found = list(Record.__subclasses__()), set[str]()
    while waiting:
        record = waiting.pop()
        waiting += record.__subclasses__()
        if record.__module__.split(".")[0] not in PACKAGES:  # of a test
            continue
        for name, field in record.fields().items():
            if isinstance(field, Field) and field.uniform:
                found.add(name)
    return found


def test_there_are_kernels_to_check() -> None:
    assert len(kernels()) > 150
    assert WIDTH == 8


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_of_libraries_are_exact_ones(package: str) -> None:
    for source in kernels():
        if not source.file.startswith(f"{package}/"):
            continue
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("np", "math"):
                assert ast.unparse(node) in EXACT or _is_annotation(node), str(source)


def _is_annotation(node: ast.Attribute) -> bool:
    return node.attr in ("float64", "ndarray", "uint64")


def test_powers_are_of_constants_or_whole() -> None:
    """``x ** y`` of the C library differs between machines."""
    for source in kernels():
        for node in ast.walk(source.tree):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                whole = isinstance(node.right, ast.Constant) and node.right.value == 2
                constant = isinstance(node.left, ast.Constant)
                assert whole or constant, str(source)
            assert not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.MatMult)


def test_what_is_uniform_is_declared_so() -> None:
    """Flights with different numbers there must not be in one batch."""
    declared, used = uniform_fields(), set[str]()
    for source in kernels():
        for node in ast.walk(source.tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("uniform", "whole"):
                (argument,) = node.args
                place = argument.value if isinstance(argument, ast.Subscript) else argument
                name = place.attr if isinstance(place, ast.Attribute) else ast.unparse(place)
                assert name in declared | SAME_IN_FLIGHT, str(source)
                used.add(name)
    assert used == declared | SAME_IN_FLIGHT
    assert not declared & SAME_IN_FLIGHT


# Numbers eight flights wide: every lane has the bits of the same kernel of plain numbers

RESULTS = 22
ANY = st.floats(width=64, allow_nan=True, allow_infinity=True, allow_subnormal=True)
NUMBERS = arrays(np.float64, (2, WIDTH), elements=ANY)


@kernel
def functions(x: float, y: float, out: Array) -> None:
    out[0] = x + y
    out[1] = x - 2.0 * y
    out[2] = x * y
    out[3] = x / y
    out[4] = -x
    out[5] = abs(x)
    out[6] = np.sqrt(abs(x)) + math.sqrt(abs(y))
    out[7] = np.floor(x)
    out[8] = np.sign(x)
    out[9] = min(x, y)
    out[10] = max(x, y)
    out[11] = math.copysign(x, y)
    out[12] = where((x < y) | (x >= 3.0), x, y)
    out[13] = where((x == y) ^ (x != 1.0), 1, y)
    out[14] = where(negated(np.isnan(x)) & np.isfinite(y), x, 0.5)
    out[15] = where(where(x > y, x <= 2.0, y > 0.5), 1.0, 2.0)
    out[16] = np.fmod(where(np.isfinite(x), x, 1.0), 2.5)
    out[17], out[18] = sin_cos(x)
    total = 0.0
    for k in range(3):
        total += k * x
        total -= y
    out[19] = total
    mantissa, exponent = math.frexp(where(np.isfinite(y), y, 3.0))
    out[20], out[21] = mantissa, exponent + 0.0


@kernel
def functions_in_lanes(numbers: Array, out: Array) -> None:
    values = as_lanes(numbers)
    functions(values[0], values[1], as_lanes(out))


@given(NUMBERS)
def test_every_lane_has_the_bits_of_a_plain_number(numbers: Array) -> None:
    out, alone = np.empty((RESULTS, WIDTH)), np.empty(RESULTS)
    functions_in_lanes(numbers, out)
    for lane in range(WIDTH):
        functions(*numbers[:, lane], alone)
        same = (out[:, lane].view(np.int64) == alone.view(np.int64)) | (
            np.isnan(out[:, lane]) & np.isnan(alone)
        )
        assert same.all(), (numbers[:, lane], np.flatnonzero(~same))


@kernel
def conditions(numbers: Array, out: Array) -> None:
    x = as_lanes(numbers)[0]
    out[0] = any_lane(x > 0.0)
    out[1] = all_lanes(x > 0.0)
    out[2] = uniform(x)
    out[3] = whole(x)
    for lane in range(WIDTH):
        out[4 + lane] = lane_of(x, lane) + lane_of(x > 0.0, lane)
    as_lanes(numbers)[0] = with_lane(x, 3, 7.0)


def test_lanes_are_read_one_by_one_and_together() -> None:
    numbers, out = np.array([[2.0, -1.0, 0.0, 4.0, 5.0, 6.0, 7.0, 8.0]]), np.zeros(12)
    before = numbers[0].copy()
    conditions(numbers, out)
    assert out[:4].tolist() == [1.0, 0.0, 2.0, 2.0]
    assert out[4:].tolist() == (before + (before > 0.0)).tolist()
    assert numbers[0].tolist() == [*before[:3], 7.0, *before[4:]]


def test_plain_numbers_have_one_lane() -> None:
    assert where(True, 1.0, 2.0) == 1.0
    assert (uniform(2.5), whole(2.9), any_lane(True), all_lanes(False)) == (2.5, 2, True, False)
    assert (negated(True), lane_of(3.0, 5), with_lane(3.0, 5, 4.0)) == (False, 3.0, 4.0)
    for function in (as_lanes, as_numbers):
        with pytest.raises(TypeError, match="only kernels"):
            function(np.zeros(8))


@kernel
def branches(numbers: Array) -> float:
    return 1.0 if as_lanes(numbers)[0] > 0.0 else 2.0


def test_a_mask_has_no_truth_value() -> None:
    with pytest.raises(NumbaError):
        branches(np.zeros((1, WIDTH)))


class Part(Record):
    matrix: Array = shaped(lambda n: (n, 3))
    number: float = shaped(lambda n: ())


class Whole(Record):
    kind: float = shaped(lambda n: (), uniform=True)
    row: Array = shaped(lambda n: (n + 1,))
    part: Part = nested(Part)
    order: Array = shaped(lambda n: (n,), uniform=True)


def test_uniform_numbers_are_those_that_lanes_share() -> None:
    block: Any = Whole.block(2)
    block["kind"], block["order"] = 3.0, [5.0, 6.0]
    block["row"], block["part"]["number"] = 9.0, 9.0
    assert np.frombuffer(Whole.uniform_numbers(block)).tolist() == [3.0, 5.0, 6.0]
