"""Assignment to a part of an array in compiled code: ``a[i:j] = b``, ``a[i] = b``, ``a[i:j] = 0``.

Numba's own provides for broadcasting and for arrays that share memory, which takes an eighth of the
compilation of all kernels. Here a contiguous array is moved into a contiguous part of the same
size, and a number is written into each element of a part. All others are left to Numba.
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
    is_like = (part.ndim, part.dtype) == (values.ndim, values.dtype)
    if not is_like or (part.layout, values.layout) != ("C", "C"):
        return arrayobj.setitem_array(context, builder, sig, args)
    source = arrayobj.make_array(values)(context, builder, args[2])
    to, shape, _ = _place(context, builder, sig, args)
    for wanted, size in zip(shape, cgutils.unpack_tuple(builder, source.shape), strict=True):
        with builder.if_then(builder.icmp_signed("!=", wanted, size), likely=False):
            context.call_conv.return_user_exc(builder, ValueError, (_SIZES,))
    cgutils.raw_memmove(builder, to, source.data, source.nitems, source.itemsize)
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
    return arrayobj.basic_indexing(context, builder, whole, array, *normal, boundscheck=False)


for _index in (types.Integer, types.SliceType, types.BaseTuple):
    imputils.lower_builtin(operator.setitem, types.Array, _index, types.Array)(_move_array)
imputils.lower_builtin(operator.setitem, types.Array, types.SliceType, types.Number)(_fill)
