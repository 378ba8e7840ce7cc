"""The words of `lanes` for Numba: choices of values, and what all lanes share."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from .lane_type import (
    BIT,
    DOUBLE,
    INDEX,
    LANE,
    LANE_VECTOR,
    MASK,
    MASK_VECTOR,
    LaneType,
    MaskType,
    array_of_lanes,
)
from .lanes import WIDTH, all_lanes, any_lane, lane_of, negated, uniform, where, whole, with_lane

_Build = Callable[..., Any]


@infer_global(negated)
class _Negated(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        (kind,) = args
        return signature(kind, kind) if isinstance(kind, (types.Boolean, MaskType)) else None


@lower_builtin(negated, types.Boolean)
@lower_builtin(negated, MaskType)
def _negated(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.not_(args[0])


@infer_global(where)
class _Where(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        if len(args) != 3 or kws:
            return None
        condition, *values = args
        result = self.context.unify_types(*(types.unliteral(value) for value in values))
        if isinstance(result, types.UniTuple):
            is_known = isinstance(condition, (types.Boolean, MaskType))
            return signature(result, condition, result, result) if is_known else None
        if condition == MASK:
            result = MASK if result == types.boolean else result
            result = LANE if isinstance(result, types.Number) else result
            return signature(result, MASK, result, result) if result in (LANE, MASK) else None
        if not isinstance(condition, types.Boolean):
            return None
        scalars = (types.Number, types.Boolean, LaneType, MaskType)
        return signature(result, condition, result, result) if isinstance(result, scalars) else None


@lower_builtin(where, MaskType, types.Any, types.Any)
@lower_builtin(where, types.Boolean, types.Any, types.Any)
def _where(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    condition, *values = args
    if not isinstance(sig.return_type, types.UniTuple):
        return builder.select(condition, *values)
    pairs = zip(*(cgutils.unpack_tuple(builder, value) for value in values), strict=True)
    return cgutils.pack_array(builder, [builder.select(condition, *pair) for pair in pairs])


def _reads_one(function: Any, of_number: Any, of_lane: Any, emit: _Build) -> None:
    """Define a function of the first lane, or of a plain number."""

    class OfFirstLane(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            (kind,) = args
            if kind in (LANE, MASK):
                return signature(of_lane(kind), kind)
            if isinstance(kind, (types.Number, types.Boolean)):
                return signature(of_number(kind), kind)
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value, kind = args[0], sig.args[0]
        if kind in (LANE, MASK):
            value = builder.extract_element(value, INDEX(0))
            kind = types.float64 if kind == LANE else types.boolean
        return emit(context, builder, value, kind, sig.return_type)

    infer_global(function)(OfFirstLane)
    for kind in (LaneType, MaskType, types.Number, types.Boolean):
        lower_builtin(function, kind)(lower)


_reads_one(
    uniform,
    types.unliteral,
    lambda kind: types.float64 if kind == LANE else types.boolean,
    lambda context, builder, value, kind, result: value,
)
_reads_one(
    whole,
    lambda kind: types.intp,
    lambda kind: types.intp,
    lambda context, builder, value, kind, result: context.cast(builder, value, kind, result),
)


def _reduces(function: Any, name: str) -> None:
    """Define a function of all lanes of a mask, or of a plain truth value."""

    class OfAllLanes(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            (kind,) = args
            is_condition = isinstance(kind, (MaskType, types.Boolean))
            return signature(types.boolean, kind) if is_condition else None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if sig.args[0] != MASK:
            return args[0]
        kind = ir.FunctionType(BIT, [MASK_VECTOR])
        whole_name = f"llvm.vector.reduce.{name}.v{WIDTH}i1"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, whole_name), args)

    infer_global(function)(OfAllLanes)
    for kind in (MaskType, types.Boolean):
        lower_builtin(function, kind)(lower)


_reduces(any_lane, "or")
_reduces(all_lanes, "and")


@infer_global(lane_of)
class _LaneOf(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        kind, _ = args
        if kind in (LANE, MASK):
            return signature(types.float64 if kind == LANE else types.boolean, kind, types.intp)
        return signature(kind, kind, types.intp) if isinstance(kind, types.Float) else None


@lower_builtin(lane_of, LaneType, types.Integer)
@lower_builtin(lane_of, MaskType, types.Integer)
def _lane_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.extract_element(*args)


@lower_builtin(lane_of, types.Float, types.Integer)
def _lane_of_number(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return args[0]


@infer_global(with_lane)
class _WithLane(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(LANE, LANE, types.intp, types.float64) if args[0] == LANE else None


@lower_builtin(with_lane, LaneType, types.Integer, types.Float)
def _with_lane(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value, lane, number = args
    return builder.insert_element(value, number, lane)


def as_lanes(array: Any) -> Any:
    """Return a contiguous array (..., 8) of floats as an array (...) of lanes, in kernels."""
    raise TypeError("only kernels see an array as lanes")


@infer_global(as_lanes)
class _AsLanes(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        (kind,) = args
        is_array = isinstance(kind, types.Array) and kind.dtype == types.float64
        if not is_array or kind.layout != "C" or kind.ndim < 1:
            return None
        return signature(array_of_lanes(kind.ndim - 1) if kind.ndim > 1 else LANE, kind)


@lower_builtin(as_lanes, types.Array)
def _as_lanes(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    from numba.np import arrayobj  # only the compiler needs it

    numbers = arrayobj.make_array(sig.args[0])(context, builder, value=args[0])
    data = builder.bitcast(numbers.data, LANE_VECTOR.as_pointer())
    if sig.return_type == LANE:
        return builder.load(data, align=1)
    shape, strides = (cgutils.unpack_tuple(builder, p) for p in (numbers.shape, numbers.strides))
    return _view(context, builder, sig.return_type, data, shape[:-1], strides[:-1], 8 * WIDTH)


def as_numbers(array: Any) -> Any:
    """Return an array (...) of lanes as one of floats (..., 8), one of floats as (..., 1)."""
    raise TypeError("only kernels see an array as numbers")


@infer_global(as_numbers)
class _AsNumbers(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        (kind,) = args
        is_array = isinstance(kind, types.Array) and kind.dtype in (LANE, types.float64)
        if not is_array or kind.layout != "C":
            return None
        return signature(types.Array(types.float64, kind.ndim + 1, "C"), kind)


@lower_builtin(as_numbers, types.Array)
def _as_numbers(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    from numba.np import arrayobj  # only the compiler needs it

    wide = arrayobj.make_array(sig.args[0])(context, builder, value=args[0])
    width = WIDTH if sig.args[0].dtype == LANE else 1
    shape, strides = (cgutils.unpack_tuple(builder, part) for part in (wide.shape, wide.strides))
    data = builder.bitcast(wide.data, DOUBLE.as_pointer())
    shape, strides = [*shape, cgutils.intp_t(width)], [*strides, cgutils.intp_t(8)]
    return _view(context, builder, sig.return_type, data, shape, strides, 8)


def _view(
    context: Any, builder: Any, kind: Any, data: Any, shape: Any, strides: Any, itemsize: int
) -> Any:
    """Emit an array of a kind over memory that another one keeps."""
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
