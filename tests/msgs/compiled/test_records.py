"""Records: one memory, seen by Python and by kernels."""

from __future__ import annotations

import copy
import pickle
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.kernels import RecordFunction, kernel
from space_robot_msgs_py.compiled.records import Record, RecordView, assign, nested, prefix, shaped
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]


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


@pytest.mark.parametrize("n", [1, 6])
def test_a_kernel_writes_what_python_reads(n: int) -> None:
    block = Outer.block(n)
    record: Outer = block[0]
    view = record.vector
    assert fill(record) == n + 1
    np.testing.assert_array_equal(view, np.full(2 * n, 2.0))
    assert block[0].scalar == 3.0
    assert record.inner.matrix[1, 2] == 4.0
    assert np.count_nonzero(record.inner.matrix) == 1


def test_allocated_records_are_zero_and_share_nothing() -> None:
    one, other = Outer.allocate(3), Outer.allocate(3)
    fill(one)
    assert not other.vector.any()
    assert other.inner.matrix.shape == (4, 3)


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


def test_a_view_is_the_same_memory() -> None:
    block = Longer.block(3)
    view = Longer.view(block)
    view.more[:], view.inner.matrix[2, 0] = 1.5, 6.0
    assert block[0].more.tolist() == [1.5] * 3
    assert block[0].inner.matrix[2, 0] == 6.0
    assert view.address == block.ctypes.data


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
