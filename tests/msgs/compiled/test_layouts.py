"""The formulas of layouts: what compiled code computes is where NumPy has put it."""

from __future__ import annotations

import importlib
import pkgutil
from collections.abc import Iterator

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from numpy.typing import NDArray

import space_robot_control
import space_robot_model
import space_robot_sim
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.layouts import Layout, Polynomial
from space_robot_msgs_py.compiled.records import Block, Record, nested, shaped

Array = NDArray[np.float64]
SIZES = (0, 1, 6, 7, 64)


def all_records(base: type[Record] = Record) -> Iterator[type[Record]]:
    for record in base.__subclasses__():
        yield record
        yield from all_records(record)


def value(polynomial: Polynomial, n: int) -> int:
    return polynomial.a + polynomial.b * n + polynomial.c * n * n


def check(layout: Layout, dtype: np.dtype[np.void], n: int) -> None:
    assert value(layout.size, n) * 8 == dtype.itemsize
    assert tuple(name for name, _ in layout.fields) == (dtype.names or ())
    for name, kind in layout.fields:
        found, offset = dtype.fields[name][:2]
        place = layout.find(name)
        assert place is not None
        assert value(place[0], n) * 8 == offset
        if isinstance(kind, Layout):
            check(kind, found, n)
        else:
            assert tuple(a + b * n for a, b in kind) == found.shape


def test_every_record_of_the_packages_is_laid_out_as_numpy_does() -> None:
    for package in (space_robot_model, space_robot_sim, space_robot_control):
        for module in pkgutil.walk_packages(package.__path__, f"{package.__name__}."):
            if "node" not in module.name and ".laws" not in module.name:
                importlib.import_module(module.name)
    names = set()
    for record in all_records():
        if record.__module__.startswith("space_robot"):
            names.add(record.__name__)
            for n in SIZES:
                check(record.layout(), record.dtype(n), n)
    assert {"PlantMemory", "ControllerMemory", "State", "Reference"} <= names


class Matrix(Record):
    matrix: Array = shaped(lambda n: (n + 3, 2 * n))
    number: float = shaped(lambda n: ())


class Mixed(Record):
    before: Array = shaped(lambda n: (n, 2))
    matrix: Matrix = nested(Matrix)
    after: Array = shaped(lambda n: (5,))


@kernel
def number_all(block: Block, first: int) -> int:
    """Write into each field its own numbers; return the joints that the shapes tell of."""
    record = block[first]
    record.before[:] = 1.0
    record.matrix.matrix[:] = 2.0
    record.matrix.matrix[-1, -1] = 3.0
    record.matrix.number = 4.0
    record.after[:] = 5.0
    return int(record.before.shape[0])


@given(n=st.integers(1, 200), size=st.integers(1, 4), data=st.data())
def test_a_kernel_finds_n_and_every_field_of_every_row(
    n: int, size: int, data: st.DataObject
) -> None:
    block = np.zeros(size, Mixed.dtype(n))
    row = data.draw(st.integers(0, size - 1))
    assert number_all(block, row) == n
    wanted = np.concatenate((np.full(2 * n, 1.0), np.full(2 * n * (n + 3), 2.0), [4.0], [5.0] * 5))
    wanted[2 * n + 2 * n * (n + 3) - 1] = 3.0
    numbers = block.view(np.float64).reshape(size, -1)
    np.testing.assert_array_equal(numbers[row], wanted)
    assert np.count_nonzero(numbers) == wanted.size
    assert len(getattr(number_all, "signatures", [0])) == 1, "one code for all n"


@kernel
def copy_rows(source: Block, out: Block) -> int:
    """Copy all rows but the first, backwards."""
    rest = source[1:]
    for k in range(rest.size):
        out[rest.size - 1 - k] = rest[k]
    return int(rest.size)


def test_rows_are_copied_whole() -> None:
    source = np.zeros(4, Mixed.dtype(3))
    source.view(np.float64)[:] = np.arange(source.nbytes // 8)
    out = np.zeros(5, Mixed.dtype(3))
    assert copy_rows(source, out) == 3
    assert out[:3].tobytes() == source[:0:-1].tobytes()
    assert not out.view(np.float64).reshape(5, -1)[3:].any()


def test_a_block_within_a_record_s_memory_is_seen_in_place() -> None:
    block = Mixed.block(4)
    block[0].matrix.number = 7.0

    @kernel
    def double(part: Block) -> None:
        part[0].number *= 2.0

    double(block["matrix"])
    assert block[0].matrix.number == 14.0


class Curved(Record):
    array: Array = shaped(lambda n: (n * n,))


def test_a_shape_must_be_linear_in_n() -> None:
    with pytest.raises(TypeError, match="the shape of field 'array' must be linear in n"):
        Curved.layout()


class Cube(Record):
    array: Array = shaped(lambda n: (n, n, n))


def test_no_array_grows_with_the_cube_of_n() -> None:
    with pytest.raises(TypeError, match="to the power of 2 at most"):
        _ = Cube.layout().size


def test_records_that_look_alike_for_one_n_are_refused() -> None:
    """Else a kernel of the one would be run on the other."""

    class One(Record):
        alike: Array = shaped(lambda n: (n,))

    class Other(Record):
        alike: Array = shaped(lambda n: (6,))

    One.dtype(6)
    with pytest.raises(TypeError, match="Other cannot be told from another record"):
        Other.dtype(6)
