"""Assignment to a part of an array in compiled code: ``a[i:j] = b``, ``a[i] = b``, ``a[i:j] = 0``.

Numba's own keeps a copy of what overlaps, and takes an eighth of the compilation of all kernels.
Here a contiguous array (n,) or (1,) is moved into a contiguous part (n,), and a number is written
into each element of a part, as NumPy does it. All others are left to Numba.
"""

from __future__ import annotations

import operator
from typing import Any

from numba.core import cgutils, imputils, types
from numba.core.typing.arraydecl import get_array_index_type
from numba.np import arrayobj as _arrayobj

arrayobj: Any = _arrayobj
_SIZES = "cannot assign an array to a part of another size"


def _move_array(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    whole, index, values = sig.args
    part = get_array_index_type(whole, index).result
    kinds = {(part.ndim, part.dtype, part.layout), (values.ndim, values.dtype, values.layout)}
    if kinds != {(1, whole.dtype, "C")}:
        return arrayobj.setitem_array(context, builder, sig, args)
    source = arrayobj.make_array(values)(context, builder, args[2])
    to, (wanted,), _ = _place(context, builder, sig, args)
    (size,) = cgutils.unpack_tuple(builder, source.shape)
    with builder.if_else(builder.icmp_signed("==", wanted, size)) as (is_alike, differs):
        with is_alike:
            cgutils.raw_memmove(builder, to, source.data, size, source.itemsize)
        with differs:
            is_one = builder.icmp_signed("==", size, size.type(1))
            with cgutils.if_unlikely(builder, builder.not_(is_one)):
                context.call_conv.return_user_exc(builder, ValueError, (_SIZES,))
            value = arrayobj.load_item(context, builder, values, source.data)
            with cgutils.for_range(builder, wanted) as loop:
                element = builder.gep(to, [loop.index])
                arrayobj.store_item(context, builder, whole, value, element)
    return context.get_dummy_value()


def _fill(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    whole, _, kind = sig.args
    to, shape, strides = _place(context, builder, sig, args)
    value = context.cast(builder, args[2], kind, whole.dtype)
    with cgutils.loop_nest(builder, shape, cgutils.intp_t) as indices:
        element = cgutils.get_item_pointer2(
            context, builder, to, shape, strides, "A", indices, wraparound=False
        )
        arrayobj.store_item(context, builder, whole, value, element)
    return context.get_dummy_value()


def _place(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Emit pointer, shape and strides of the part."""
    whole, index = sig.args[:2]
    is_tuple = isinstance(index, types.BaseTuple)
    indices = cgutils.unpack_tuple(builder, args[1]) if is_tuple else (args[1],)
    array = arrayobj.make_array(whole)(context, builder, args[0])
    normal = arrayobj.normalize_indices(
        context, builder, index.types if is_tuple else (index,), indices
    )
    checks = context.enable_boundscheck
    return arrayobj.basic_indexing(context, builder, whole, array, *normal, boundscheck=checks)


for _index in (types.Integer, types.SliceType, types.BaseTuple):
    imputils.lower_builtin(operator.setitem, types.Array, _index, types.Array)(_move_array)
imputils.lower_builtin(operator.setitem, types.Array, types.SliceType, types.Number)(_fill)
