"""The language of kernels (docs/explanation/kernels.md), checked over their syntax trees."""

from __future__ import annotations

import ast
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from typing import NamedTuple

import pytest

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import Field, Record

ROOT = Path(__file__).parents[3]
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


def sources() -> Iterator[Source]:
    for package in PACKAGES:
        for path in sorted((ROOT / package).rglob("*.py")):
            for node in ast.walk(ast.parse(path.read_text("utf-8"))):
                if isinstance(node, ast.FunctionDef) and any(
                    isinstance(d, ast.Name) and d.id in ("kernel", "subroutine")
                    for d in node.decorator_list
                ):
                    yield Source(str(path.relative_to(ROOT)), node)


KERNELS = list(sources())


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
    assert len(KERNELS) > 150
    assert WIDTH == 8


@pytest.mark.parametrize("package", PACKAGES)
def test_functions_of_libraries_are_exact_ones(package: str) -> None:
    for kernel in KERNELS:
        if not kernel.file.startswith(f"{package}/"):
            continue
        for node in ast.walk(kernel.tree):
            if isinstance(node, ast.Attribute) and ast.unparse(node.value) in ("np", "math"):
                assert ast.unparse(node) in EXACT or _is_annotation(node), str(kernel)


def _is_annotation(node: ast.Attribute) -> bool:
    return node.attr in ("float64", "ndarray", "uint64")


def test_powers_are_of_constants_or_whole() -> None:
    """``x ** y`` of the C library differs between machines."""
    for kernel in KERNELS:
        for node in ast.walk(kernel.tree):
            if isinstance(node, ast.BinOp) and isinstance(node.op, ast.Pow):
                whole = isinstance(node.right, ast.Constant) and node.right.value == 2
                constant = isinstance(node.left, ast.Constant)
                assert whole or constant, str(kernel)
            assert not isinstance(node, ast.BinOp) or not isinstance(node.op, ast.MatMult)


def test_what_is_uniform_is_declared_so() -> None:
    """Flights with different numbers there must not be in one batch."""
    declared, used = uniform_fields(), set[str]()
    for kernel in KERNELS:
        for node in ast.walk(kernel.tree):
            if isinstance(node, ast.Call) and ast.unparse(node.func) in ("uniform", "whole"):
                (argument,) = node.args
                place = argument.value if isinstance(argument, ast.Subscript) else argument
                name = place.attr if isinstance(place, ast.Attribute) else ast.unparse(place)
                assert name in declared | SAME_IN_FLIGHT, str(kernel)
                used.add(name)
    assert used == declared | SAME_IN_FLIGHT
    assert not declared & SAME_IN_FLIGHT
