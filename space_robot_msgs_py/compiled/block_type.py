"""Blocks in compiled code: arrays (k,) of records, one type for any number of joints n.

``block[i]`` is a record, ``block[i:j]`` a block, ``block.size`` is k, and ``block[i] = record``
copies it. For a block from Python, n follows from the size of its items.
"""

from __future__ import annotations

import operator
from functools import cache
from typing import Any

import numpy as np
from numba.core import cgutils, imputils, types
from numba.core.pythonapi import NativeValue
from numba.core.typing.templates import (
    AbstractTemplate,
    AttributeTemplate,
    infer_getattr,
    infer_global,
    signature,
)
from numba.core.typing.typeof import typeof_impl
from numba.extending import models, register_model, unbox

from .layouts import Layout
from .record_type import RecordType, joints, record_type, value_of
from .records import layout_of

_typeof_array = typeof_impl.dispatch(np.ndarray)


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


@infer_global(operator.getitem)
class _GetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        block, index = args
        if not isinstance(block, BlockType):
            return None
        if isinstance(index, types.Integer):
            return signature(block.record, block, types.intp)
        return signature(block, block, index) if isinstance(index, types.SliceType) else None


@infer_global(operator.setitem)
class _SetItem(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        block, _, record = args
        if not isinstance(block, BlockType) or record != block.record:
            return None
        return signature(types.void, block, types.intp, record)


def _item(builder: Any, block: Any, index: Any) -> Any:
    return cgutils.pointer_add(builder, block.data, builder.mul(index, block.step, flags=["nsw"]))


@imputils.lower_builtin(operator.getitem, BlockType, types.Integer)
def _get_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    block = cgutils.create_struct_proxy(sig.args[0])(context, builder, value=args[0])
    record = cgutils.create_struct_proxy(sig.return_type)(context, builder)
    record.data, record.n = _item(builder, block, args[1]), block.n
    return record._getvalue()


@imputils.lower_builtin(operator.getitem, BlockType, types.SliceType)
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


@imputils.lower_builtin(operator.setitem, BlockType, types.Integer, RecordType)
def _set_item(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    kind, _, record_type = sig.args
    block = cgutils.create_struct_proxy(kind)(context, builder, value=args[0])
    record = cgutils.create_struct_proxy(record_type)(context, builder, value=args[2])
    numbers = value_of(builder, kind.record.layout.size, block.n)
    cgutils.raw_memcpy(
        builder, _item(builder, block, args[1]), record.data, numbers, kind.record.bytes
    )
    return context.get_dummy_value()
