"""Records, and blocks of them, in compiled code: a pointer and the number of joints n.

The same layout is read with plain numbers, or with lanes in their place (`lane_type`).

Numba's type of a record has constant field offsets, so that functions of the record are compiled
again for every n. Here offsets and shapes are computed from the formulas of `Layout` when a field
is read. Kernels see the same: numbers, arrays and nested records as attributes. For a record from
Python, n follows from its size.

A block is an array (k,) of records: ``block[i]`` is a record, ``block[i:j]`` a block,
``block.size`` is k, and ``block[i] = record`` copies it.
"""

from __future__ import annotations

import hashlib
import operator
from collections.abc import Callable
from functools import cache
from typing import Any, ClassVar

import numpy as np
from numba.core import cgutils, imputils, types
from numba.core.pythonapi import NativeValue
from numba.core.registry import cpu_target
from numba.core.typing import templates
from numba.core.typing.templates import AttributeTemplate, infer_getattr, signature
from numba.core.typing.typeof import typeof_impl
from numba.extending import models, register_model, unbox

from .records import Dimension, Layout, Polynomial, layout_of

BYTES = 8
"""Size of a float64, of which all records consist, bytes."""
_INT = cgutils.intp_t
_FLOAT = cpu_target.target_context.get_value_type(types.float64)
_typeof_array = typeof_impl.dispatch(np.ndarray)
_typeof_scalar = typeof_impl.dispatch(np.generic)


def defines(function: Any, typing: Callable[..., Any], *kinds: tuple[Any, ...]) -> Any:
    """Return a decorator: what it decorates emits ``function`` for arguments of these kinds.

    Args:
        function: as kernels call it.
        typing: from the arguments' types to the signature; None: these are not for us.
        kinds: classes of types.
    """

    class Template(templates.AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            return None if kws else typing(*args)

    def decorate(emit: Callable[..., Any]) -> Callable[..., Any]:
        templates.infer_global(function)(Template)
        for kind in kinds:
            imputils.lower_builtin(function, *kind)(emit)
        return emit

    return decorate


def array_over(
    context: Any, builder: Any, kind: Any, data: Any, shape: Any, strides: Any, itemsize: int
) -> Any:
    """Emit an array of a Numba type over memory that something else owns."""
    from numba.np import arrayobj  # only the compiler needs it

    array = arrayobj.make_array(kind)(context, builder)
    arrayobj.populate_array(
        array,
        data=data,
        shape=cgutils.pack_array(builder, shape),
        strides=cgutils.pack_array(builder, strides),
        itemsize=cgutils.intp_t(itemsize),
        meminfo=None,
        parent=None,
    )
    return array._getvalue()


class RecordType(types.Type):
    """Numba type of a record with a layout, of numbers ``width`` flights wide (1 or 8)."""

    of_lanes: ClassVar[Callable[[int], Any]]  # set by `lane_type`, which the compiler imports

    def __init__(self, layout: Layout, width: int = 1) -> None:
        self.layout, self.width = layout, width
        super().__init__(f"Record{digest(layout)}x{width}")

    @property
    def key(self) -> Any:
        """Identity of the type, for Numba."""
        return self.layout, self.width

    @property
    def bytes(self) -> int:
        """Size of one of its numbers."""
        return BYTES * self.width

    def array(self, ndim: int) -> Any:
        """Return the type of a field with so many dimensions."""
        if self.width == 1:
            return types.Array(types.float64, ndim, "C") if ndim else types.float64
        return RecordType.of_lanes(ndim)


@cache
def record_type(layout: Layout, width: int) -> RecordType:
    """Return the `RecordType`, always the same one."""
    return RecordType(layout, width)


@cache
def digest(layout: Layout) -> str:
    """Return a short name of a layout, for the keys of Numba's cache."""
    return hashlib.sha256(repr(layout).encode()).hexdigest()[:16]


@register_model(RecordType)
class _RecordModel(models.StructModel):
    def __init__(self, manager: Any, kind: RecordType) -> None:
        super().__init__(manager, kind, [("data", types.voidptr), ("n", types.intp)])


@typeof_impl.register(np.record)
def _typeof_record(value: Any, context: Any) -> Any:
    known = layout_of(value.dtype)
    return record_type(*known) if known else _typeof_scalar(value, context)


@unbox(RecordType)
def _unbox_record(kind: RecordType, scalar: Any, c: Any) -> Any:
    buffer = c.pyapi.alloca_buffer()
    pointer = c.pyapi.extract_record_data(scalar, buffer)
    record = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    record.data = pointer
    words = c.builder.bitcast(buffer, _INT.as_pointer())
    length = c.builder.load(c.builder.gep(words, [_INT(2)]))  # Py_buffer.len
    record.n = joints(c.builder, kind, length)
    return NativeValue(
        record._getvalue(),
        is_error=cgutils.is_null(c.builder, pointer),
        cleanup=lambda: c.pyapi.release_buffer(buffer),
    )


def joints(builder: Any, kind: RecordType, itemsize: Any) -> Any:
    """Emit n from a record's size in bytes and its polynomial; 0 if the size is constant."""
    a, b, c = kind.layout.size
    numbers = builder.sub(builder.sdiv(itemsize, _INT(kind.bytes)), _INT(a))
    if c == 0:
        return builder.sdiv(numbers, _INT(b)) if b else _INT(0)
    # b n + c n^2 = numbers, with an integer root
    square = builder.add(builder.mul(numbers, _INT(4 * c)), _INT(b * b))
    sqrt = builder.module.declare_intrinsic("llvm.sqrt", [_FLOAT])
    root = builder.call(sqrt, [builder.sitofp(square, _FLOAT)])
    n = builder.fdiv(builder.fsub(root, _FLOAT(float(b))), _FLOAT(2.0 * c))
    return builder.fptosi(builder.fadd(n, _FLOAT(0.5)), _INT)


@infer_getattr
class _RecordAttributes(AttributeTemplate):
    key = RecordType

    def generic_resolve(self, record: RecordType, name: str) -> Any:  # type: ignore[override]
        place = record.layout.find(name)
        if place is None:
            return None
        kind = place[1]
        if isinstance(kind, Layout):
            return record_type(kind, record.width)
        return record.array(len(kind))


@imputils.lower_getattr_generic(RecordType)
def _get_field(context: Any, builder: Any, kind: RecordType, value: Any, name: str) -> Any:
    record = cgutils.create_struct_proxy(kind)(context, builder, value=value)
    offset, field = _place_of(kind, name)
    place = _place(builder, kind, record.data, offset, record.n)
    if isinstance(field, Layout):
        inner = cgutils.create_struct_proxy(record_type(field, kind.width))(context, builder)
        inner.data, inner.n = place, record.n
        return inner._getvalue()
    numbers = builder.bitcast(place, context.get_value_type(kind.array(0)).as_pointer())
    if not field:
        return builder.load(numbers, align=BYTES)
    shape = [value_of(builder, Polynomial(*dimension), record.n) for dimension in field]
    strides: list[Any] = []
    step: Any = _INT(kind.bytes)
    for k, length in enumerate(reversed(shape)):
        strides.insert(0, step)
        step = builder.mul(step, length, flags=["nsw"]) if k + 1 < len(shape) else step
    array = kind.array(len(field))
    return array_over(context, builder, array, numbers, shape, strides, kind.bytes)


@imputils.lower_setattr_generic(RecordType)
def _set_field(context: Any, builder: Any, sig: Any, args: Any, name: str) -> None:
    kind, value_type = sig.args
    offset, field = _place_of(kind, name)
    if field != ():
        raise TypeError(f"write {name}[:] = ...")
    record = cgutils.create_struct_proxy(kind)(context, builder, value=args[0])
    number = context.cast(builder, args[1], value_type, kind.array(0))
    place = _place(builder, kind, record.data, offset, record.n)
    builder.store(number, builder.bitcast(place, number.type.as_pointer()), align=BYTES)


def _place_of(kind: RecordType, name: str) -> tuple[Polynomial, tuple[Dimension, ...] | Layout]:
    place = kind.layout.find(name)
    assert place is not None
    return place


def _place(builder: Any, kind: RecordType, data: Any, offset: Polynomial, n: Any) -> Any:
    factors = Polynomial(*(kind.bytes * factor for factor in offset))
    return cgutils.pointer_add(builder, data, value_of(builder, factors, n))


def value_of(builder: Any, polynomial: Polynomial, n: Any) -> Any:
    """Emit ``a + (b + c n) n``."""
    total: Any = None
    for factor in reversed(polynomial):
        if total is not None:
            total = builder.mul(total, n, flags=["nsw"])
            total = builder.add(total, _INT(factor), flags=["nsw"]) if factor else total
        elif factor:
            total = _INT(factor)
    return _INT(0) if total is None else total


class BlockType(types.Type):
    """Numba type of a block of records with a layout."""

    def __init__(self, layout: Layout, width: int = 1) -> None:
        self.record = record_type(layout, width)
        super().__init__(f"Block{self.record.name}")

    @property
    def key(self) -> Any:
        """Identity of the type, for Numba."""
        return self.record.key


@cache
def block_type(layout: Layout, width: int) -> BlockType:
    """Return the `BlockType`, always the same one."""
    return BlockType(layout, width)


@register_model(BlockType)
class _BlockModel(models.StructModel):
    def __init__(self, manager: Any, kind: BlockType) -> None:
        members = [("data", types.voidptr), ("n", types.intp)]
        super().__init__(manager, kind, [*members, ("size", types.intp), ("step", types.intp)])


@typeof_impl.register(np.ndarray)
def _typeof_block(value: Any, context: Any) -> Any:
    known = layout_of(value.dtype) if value.dtype.names and value.ndim == 1 else None
    return block_type(*known) if known else _typeof_array(value, context)


@unbox(BlockType)
def _unbox_block(kind: BlockType, array: Any, c: Any) -> Any:
    from numba.np import arrayobj  # only the compiler needs it

    plain = types.Array(types.uint8, 1, "A")
    native = arrayobj.make_array(plain)(c.context, c.builder)
    pointer = c.builder.bitcast(native._getpointer(), c.pyapi.voidptr)
    error = cgutils.is_not_null(c.builder, c.pyapi.nrt_adapt_ndarray_from_python(array, pointer))
    block = cgutils.create_struct_proxy(kind)(c.context, c.builder)
    block.data = c.builder.bitcast(native.data, cgutils.voidptr_t)
    block.n = joints(c.builder, kind.record, native.itemsize)
    (block.size,) = cgutils.unpack_tuple(c.builder, native.shape)
    (block.step,) = cgutils.unpack_tuple(c.builder, native.strides)
    # the caller holds the reference to the array
    c.context.nrt.decref(c.builder, plain, native._getvalue())
    return NativeValue(block._getvalue(), is_error=error)


@infer_getattr
class _BlockAttributes(AttributeTemplate):
    key = BlockType

    def resolve_size(self, block: BlockType) -> Any:
        return types.intp


@imputils.lower_getattr(BlockType, "size")
def _size_of_block(context: Any, builder: Any, kind: BlockType, value: Any) -> Any:
    return cgutils.create_struct_proxy(kind)(context, builder, value=value).size


def _item(builder: Any, block: Any, index: Any) -> Any:
    return cgutils.pointer_add(builder, block.data, builder.mul(index, block.step, flags=["nsw"]))


def _type_of_item(block: Any, index: Any) -> Any:
    is_one = isinstance(block, BlockType) and isinstance(index, types.Integer)
    return signature(block.record, block, types.intp) if is_one else None


@defines(operator.getitem, _type_of_item, (BlockType, types.Integer))
def _get_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    block = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0])
    record = cgutils.create_struct_proxy(sig.return_type)(context, builder)
    record.data, record.n = _item(builder, block, args[1]), block.n
    return record._getvalue()


def _type_of_part(block: Any, index: Any) -> Any:
    is_part = isinstance(block, BlockType) and isinstance(index, types.SliceType)
    return signature(block, block, index) if is_part else None


@defines(operator.getitem, _type_of_part, (BlockType, types.SliceType))
def _get_items(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    from numba.cpython import slicing  # only the compiler needs it

    kind, slice_type = sig.args
    block = cgutils.create_struct_proxy(kind)(context, builder, value=args[0])
    part = context.make_helper(builder, slice_type, args[1])
    slicing.guard_invalid_slice(context, builder, slice_type, part)
    slicing.fix_slice(builder, part, block.size)
    proxy = cgutils.create_struct_proxy(kind)(context, builder, value=args[0])
    proxy.data = _item(builder, block, part.start)
    proxy.size = slicing.get_slice_length(builder, part)
    proxy.step = builder.mul(block.step, part.step)
    return proxy._getvalue()


def _type_of_assignment(block: Any, index: Any, record: Any) -> Any:
    fits = isinstance(block, BlockType) and record == block.record
    return signature(types.void, block, types.intp, record) if fits else None


@defines(operator.setitem, _type_of_assignment, (BlockType, types.Integer, RecordType))
def _set_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, _, record_type = sig.args
    block = cgutils.create_struct_proxy(kind)(context, builder, value=args[0])
    record = cgutils.create_struct_proxy(record_type)(context, builder, value=args[2])
    numbers = value_of(builder, kind.record.layout.size, block.n)
    cgutils.raw_memcpy(
        builder, _item(builder, block, args[1]), record.data, numbers, kind.record.bytes
    )
    return context.get_dummy_value()
