"""Records: one memory, laid out alike by Python and by kernels."""

from __future__ import annotations

import copy
import importlib
import pickle
import pkgutil
from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

import space_robot_control
import space_robot_model
import space_robot_sim
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.records import (
    Block,
    Layout,
    Polynomial,
    Record,
    RecordView,
    assign,
    nested,
    prefix,
    shaped,
)
from space_robot_msgs_py.errors import InputError


class Inner(Record):
    matrix: Array = shaped(lambda n: (n + 1, 3))


class Outer(Record):
    vector: Array = shaped(lambda n: (2 * n,))
    scalar: float = shaped(lambda n: ())
    inner: Inner = nested(Inner)


@kernel
def fill(record: Outer) -> int:
    record.vector[:] = 2.0
    record.scalar = 3.0
    record.inner.matrix[1, 2] = 4.0
    return record.inner.matrix.shape[0]


def test_assign_copies_arrays_and_records() -> None:
    record, inner = Outer.allocate(2), Inner.allocate(2)
    inner.matrix[:] = 5.0
    assign(record, inner=inner, vector=[1.0, 2.0, 3.0, 4.0], scalar=6.0)
    inner.matrix[:] = 0.0
    assert record.inner.matrix.min() == 5.0
    assert record.vector.tolist() == [1.0, 2.0, 3.0, 4.0]
    assert record.scalar == 6.0


def test_assigning_to_an_unknown_field_is_an_error() -> None:
    with pytest.raises(ValueError, match="no field of name mass"):
        assign(Outer.allocate(2), mass=1.0)


class Longer(Outer):
    more: Array = shaped(lambda n: (n,))


def test_a_record_begins_with_the_fields_of_its_base() -> None:
    """Who knows the base alone reads and writes them in the same memory."""
    block = Longer.block(4)
    assert list(Longer.fields()) == ["vector", "scalar", "inner", "more"]
    block[0].more[:] = 7.0
    fill(prefix(block, Outer.dtype(4))[0])
    np.testing.assert_array_equal(block[0].vector, np.full(8, 2.0))
    assert block[0].inner.matrix[1, 2] == 4.0
    assert block[0].more.tolist() == [7.0] * 4


def test_scalar_fields_of_a_view_are_floats_of_now() -> None:
    """Also where the view writes them: there is no number but that in the block."""
    block = Longer.block(3)
    view = Longer.view(block)
    assert view.scalar == 0.0
    block[0].scalar = 2.5
    assert view.scalar == 2.5
    assert type(view.scalar) is float
    view.scalar += 1.0
    assert block[0].scalar == view.scalar == 3.5
    block[:] = np.zeros_like(block)
    assert view.scalar == 0.0
    with pytest.raises(AttributeError, match="no attribute 'vectors'"):
        view.vectors  # type: ignore[attr-defined]  # noqa: B018


class OuterView(RecordView):
    owner: str

    def twice(self) -> float:
        outer: Any = self
        return 2.0 * float(outer.scalar)


class Viewed(Outer):
    view_type = OuterView


def test_a_view_has_the_class_that_its_record_names() -> None:
    """With methods, and with attributes that are no fields; inner records have their own."""
    block = Viewed.block(3)
    block[0].scalar = 4.0
    view: Any = Viewed.view(block)
    assert isinstance(view, OuterView)
    assert type(view.inner) is RecordView
    plain: Any = Outer.view(Outer.block(2))
    assert type(plain) is RecordView
    assert view.twice() == 8.0
    assert not hasattr(view, "owner")
    view.owner = "me"
    assert view.owner == "me"
    assert "view_type" not in Viewed.fields()


@pytest.mark.parametrize("copying", [copy.copy, copy.deepcopy, pickle.dumps])
def test_a_view_with_scalars_is_not_copied(copying: Any) -> None:
    with pytest.raises(TypeError, match="a view of a record cannot be copied or pickled"):
        copying(Viewed.view(Viewed.block(3)))


@kernel
def misspelt(record: Inner, period: float) -> None:
    record.matrices[0, 0] = period  # type: ignore[attr-defined]


def test_a_kernel_that_cannot_be_compiled_is_one_line_with_its_place() -> None:
    with pytest.raises(InputError) as error:
        RecordFunction(misspelt, (Inner,), (Inner,))
    line = misspelt.py_func.__code__.co_firstlineno + 2  # type: ignore[attr-defined]
    assert str(error.value).startswith("misspelt cannot be compiled: Unknown attribute 'matrices'")
    assert str(error.value).endswith(f"test_records.py, line {line})")
    assert "\n" not in str(error.value)


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


class Curved(Record):
    array: Array = shaped(lambda n: (n * n,))


class Cube(Record):
    array: Array = shaped(lambda n: (n, n, n))


def test_a_shape_must_be_linear_in_n_and_no_array_grows_with_its_cube() -> None:
    with pytest.raises(TypeError, match="the shape of field 'array' must be linear in n"):
        Curved.layout()
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
