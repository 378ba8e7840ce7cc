"""The number that is eight numbers wide, as a type of Numba (0.58 to 0.68) and llvmlite.

Its value is a vector of LLVM, ``<8 x double>``, which the compiler turns into the instructions of
the processor. IEEE arithmetic of a vector is that of its elements, so a lane has the bits of a
plain number. A comparison gives a mask, ``<8 x i1>``; it has no truth value. The functions of
`lanes` are defined for both here.
"""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any, ClassVar

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_cast
from numba.core.registry import cpu_target
from numba.core.typeconv.castgraph import Conversion
from numba.core.typing.templates import signature
from numba.extending import models, register_model

from .lanes import (
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
from .record_type import RecordType, array_over, defines

_Build = Callable[..., Any]
DOUBLE, BIT, INDEX = ir.DoubleType(), ir.IntType(1), ir.IntType(32)
LANE_VECTOR, MASK_VECTOR = ir.VectorType(DOUBLE, WIDTH), ir.VectorType(BIT, WIDTH)


class WideType(types.Type):
    """Base class of types that are eight wide; a plain value converts, the same in all lanes."""

    plain: ClassVar[Any]
    """Kind of the plain values."""

    def __init__(self) -> None:
        super().__init__(f"{type(self).__name__}{WIDTH}")

    def can_convert_from(self, typingctx: Any, other: Any) -> Any:
        """Convert plain values."""
        return Conversion.safe if isinstance(other, self.plain) else None

    def unify(self, typingctx: Any, other: Any) -> Any:
        """Take the place of plain values."""
        return self if isinstance(other, self.plain) else None


class LaneType(WideType):
    """Numba type of eight floats."""

    plain = types.Number


class MaskType(WideType):
    """Numba type of eight truth values."""

    plain = types.Boolean


LANE, MASK = LaneType(), MaskType()


def array_of_lanes(ndim: int) -> Any:
    """Return the type of an array of lanes, or of one; loads do not rely on its alignment."""
    return types.Array(LANE, ndim, "C", aligned=False) if ndim else LANE


RecordType.of_lanes = staticmethod(array_of_lanes)


@register_model(LaneType)
class _LaneModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, LANE_VECTOR)


@register_model(MaskType)
class _MaskModel(models.PrimitiveModel):
    def __init__(self, manager: Any, kind: Any) -> None:
        super().__init__(manager, kind, MASK_VECTOR)


@lower_cast(types.Number, LaneType)
def _number_to_lanes(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    number = context.cast(builder, value, types.unliteral(fromty), types.float64)
    return _spread(builder, number, LANE_VECTOR)


@lower_cast(types.Boolean, MaskType)
def _boolean_to_mask(context: Any, builder: Any, fromty: Any, toty: Any, value: Any) -> Any:
    return _spread(builder, cgutils.as_bool_bit(builder, value), MASK_VECTOR)


def _spread(builder: Any, value: Any, vector: Any) -> Any:
    unknown = ir.Constant(vector, ir.Undefined)
    first = builder.insert_element(unknown, value, INDEX(0))
    zeros = ir.Constant(ir.VectorType(INDEX, WIDTH), [0] * WIDTH)
    return builder.shuffle_vector(first, unknown, zeros)


_CONDITIONS, _SCALARS = (
    (MaskType, types.Boolean),
    (LaneType, MaskType, types.Number, types.Boolean),
)
_EITHER_CONDITION = tuple((kind,) for kind in _CONDITIONS)


def _plain(kind: Any) -> Any:
    if kind in (LANE, MASK):
        return types.float64 if kind == LANE else types.boolean
    return types.unliteral(kind)


# Arithmetic, comparisons and functions


def _is_number(kind: Any) -> bool:
    return isinstance(kind, (types.Float, types.Integer, types.Literal))


def _some_lanes(args: Any) -> bool:
    return LANE in args and all(kind == LANE or _is_number(kind) for kind in args)


def _some_masks(args: Any) -> bool:
    return MASK in args and all(isinstance(kind, _CONDITIONS) for kind in args)


def _define_all(
    functions: dict[Any, _Build], arity: int, result: Any = LANE, of: Any = LANE
) -> None:
    accepts = _some_lanes if of is LANE else _some_masks

    def typing(*args: Any) -> Any:
        return signature(result, *[of] * arity) if len(args) == arity and accepts(args) else None

    for names, build in functions.items():

        def emit(context: Any, builder: Any, sig: Any, args: Any, build: _Build = build) -> Any:
            return build(builder, *args)

        for function in names if isinstance(names, tuple) else (names,):
            defines(function, typing, (type(of),) * arity)(emit)


def _intrinsic(name: str, arity: int = 1) -> _Build:
    def build(builder: Any, *args: Any) -> Any:
        kind = ir.FunctionType(LANE_VECTOR, [LANE_VECTOR] * arity)
        whole_name = f"llvm.{name}.v{WIDTH}f64"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, whole_name), args)

    return build


def _arithmetic(name: str) -> _Build:
    return lambda builder, a, b: getattr(builder, name)(a, b)


def _comparison(sign: str) -> _Build:
    if sign == "!=":
        return lambda builder, a, b: builder.fcmp_unordered(sign, a, b)
    return lambda builder, a, b: builder.fcmp_ordered(sign, a, b)


def _constant(value: float) -> Any:
    return ir.Constant(LANE_VECTOR, [DOUBLE(value)] * WIDTH)


def _second_if(sign: str) -> _Build:
    """Return an emitter of Python's ``min`` or ``max``: the second argument if it compares so."""
    return lambda builder, a, b: builder.select(builder.fcmp_ordered(sign, b, a), b, a)


def _sign(builder: Any, x: Any) -> Any:
    zero = _constant(0.0)  # zeros and NaN stay what they are
    below = builder.select(builder.fcmp_ordered("<", x, zero), _constant(-1.0), x)
    return builder.select(builder.fcmp_ordered(">", x, zero), _constant(1.0), below)


def _is_finite(builder: Any, x: Any) -> Any:
    return builder.fcmp_ordered("<", _intrinsic("fabs")(builder, x), _constant(math.inf))


def _is_nan(builder: Any, x: Any) -> Any:
    return builder.fcmp_unordered("uno", x, x)


_define_all(
    {
        (operator.add, operator.iadd): _arithmetic("fadd"),
        (operator.sub, operator.isub): _arithmetic("fsub"),
        (operator.mul, operator.imul): _arithmetic("fmul"),
        (operator.truediv, operator.itruediv): _arithmetic("fdiv"),
        min: _second_if("<"),
        max: _second_if(">"),
        (math.copysign, np.copysign): _intrinsic("copysign", 2),
    },
    2,
)
_define_all(
    {
        operator.lt: _comparison("<"),
        operator.le: _comparison("<="),
        operator.gt: _comparison(">"),
        operator.ge: _comparison(">="),
        operator.eq: _comparison("=="),
        operator.ne: _comparison("!="),
    },
    2,
    MASK,
)
_define_all(
    {
        operator.neg: lambda builder, x: builder.fneg(x),
        operator.pos: lambda builder, x: x,
        (abs, np.abs, math.fabs): _intrinsic("fabs"),
        (np.sqrt, math.sqrt): _intrinsic("sqrt"),
        np.floor: _intrinsic("floor"),
        np.sign: _sign,
    },
    1,
)
_define_all({(np.isnan, math.isnan): _is_nan, (np.isfinite, math.isfinite): _is_finite}, 1, MASK)
_define_all(
    {
        operator.and_: _arithmetic("and_"),
        operator.or_: _arithmetic("or_"),
        operator.xor: _arithmetic("xor"),
    },
    2,
    MASK,
    MASK,
)


def _type_of_exponent(kind: Any) -> Any:
    return signature(types.UniTuple(LANE, 2), LANE) if kind == LANE else None


@defines(math.frexp, _type_of_exponent, (LaneType,))
def _exponent(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Emit mantissa and exponent, both as floats, from the bits of a float."""
    (x,) = args
    words = ir.VectorType(ir.IntType(64), WIDTH)

    def bits(value: int) -> Any:
        return ir.Constant(words, [value] * WIDTH)

    is_small = builder.fcmp_ordered("<", _intrinsic("fabs")(builder, x), _constant(2.0**-1022))
    normal = builder.select(is_small, builder.fmul(x, _constant(2.0**54)), x)
    word = builder.bitcast(normal, words)
    power = builder.and_(builder.lshr(word, bits(52)), bits(0x7FF))
    two_52 = builder.bitcast(builder.or_(power, bits(0x433 << 52)), LANE_VECTOR)  # 2**52 + power
    offset = builder.select(is_small, _constant(2.0**52 + 1076), _constant(2.0**52 + 1022))
    half = builder.or_(builder.and_(word, bits(~(0x7FF << 52))), bits(1022 << 52))
    mantissa, exponent = builder.bitcast(half, LANE_VECTOR), builder.fsub(two_52, offset)
    is_nonzero = builder.fcmp_unordered("!=", x, _constant(0.0))
    is_usual = builder.and_(_is_finite(builder, x), is_nonzero)
    return cgutils.pack_array(
        builder,
        [builder.select(is_usual, mantissa, x), builder.select(is_usual, exponent, _constant(0.0))],
    )


def _type_of_remainder(*args: Any) -> Any:
    return signature(LANE, LANE, LANE) if _some_lanes(args) else None


@defines(np.fmod, _type_of_remainder, (LaneType, LaneType))
def _remainder(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Emit the function of plain numbers lane by lane: it is rare."""
    plain = signature(types.float64, types.float64, types.float64)
    function = context.get_function(np.fmod, plain)
    total = ir.Constant(LANE_VECTOR, ir.Undefined)
    for k in range(WIDTH):
        one = function(builder, [builder.extract_element(value, INDEX(k)) for value in args])
        total = builder.insert_element(total, one, INDEX(k))
    return total


# Choices of values, and what all lanes share


def _type_of_negated(kind: Any) -> Any:
    return signature(kind, kind) if isinstance(kind, _CONDITIONS) else None


@defines(negated, _type_of_negated, *_EITHER_CONDITION)
def _negated(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.not_(args[0])


def _type_of_where(condition: Any, *values: Any) -> Any:
    if not isinstance(condition, _CONDITIONS):
        return None
    result = cpu_target.typing_context.unify_types(*map(types.unliteral, values))
    if isinstance(result, types.UniTuple):
        return signature(result, condition, result, result)
    if condition == MASK:
        result = MASK if result == types.boolean else result
        result = LANE if isinstance(result, types.Number) else result
        return signature(result, MASK, result, result) if result in (LANE, MASK) else None
    return signature(result, condition, result, result) if isinstance(result, _SCALARS) else None


@defines(where, _type_of_where, *((kind, types.Any, types.Any) for kind in _CONDITIONS))
def _where(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    condition, *values = args
    if not isinstance(sig.return_type, types.UniTuple):
        return builder.select(condition, *values)
    pairs = zip(*(cgutils.unpack_tuple(builder, value) for value in values), strict=True)
    return cgutils.pack_array(builder, [builder.select(condition, *pair) for pair in pairs])


def _reads_one(function: Any, result: Callable[[Any], Any]) -> None:
    def typing(kind: Any) -> Any:
        return signature(result(kind), kind) if isinstance(kind, _SCALARS) else None

    @defines(function, typing, *((kind,) for kind in _SCALARS))
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        value, kind = args[0], sig.args[0]
        if kind in (LANE, MASK):
            value, kind = builder.extract_element(value, INDEX(0)), _plain(kind)
        return context.cast(builder, value, kind, sig.return_type)


_reads_one(uniform, _plain)
_reads_one(whole, lambda kind: types.intp)


def _reduces(function: Any, name: str) -> None:
    def typing(kind: Any) -> Any:
        return signature(types.boolean, kind) if isinstance(kind, _CONDITIONS) else None

    @defines(function, typing, *_EITHER_CONDITION)
    def emit(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        if sig.args[0] != MASK:
            return args[0]
        kind = ir.FunctionType(BIT, [MASK_VECTOR])
        whole_name = f"llvm.vector.reduce.{name}.v{WIDTH}i1"
        return builder.call(cgutils.get_or_insert_function(builder.module, kind, whole_name), args)


_reduces(any_lane, "or")
_reduces(all_lanes, "and")


def _type_of_lane(kind: Any, lane: Any) -> Any:
    known = (LaneType, MaskType, types.Float)
    return signature(_plain(kind), kind, types.intp) if isinstance(kind, known) else None


@defines(
    lane_of, _type_of_lane, *((kind, types.Integer) for kind in (LaneType, MaskType, types.Float))
)
def _lane_of(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    return builder.extract_element(*args) if sig.args[0] in (LANE, MASK) else args[0]


def _type_with_lane(kind: Any, lane: Any, number: Any) -> Any:
    return signature(LANE, LANE, types.intp, types.float64) if kind == LANE else None


@defines(with_lane, _type_with_lane, (LaneType, types.Integer, types.Float))
def _with_lane(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    value, lane, number = args
    return builder.insert_element(value, number, lane)


def _type_as_lanes(kind: Any) -> Any:
    is_array = isinstance(kind, types.Array) and kind.dtype == types.float64
    if not is_array or kind.layout != "C" or kind.ndim < 1:
        return None
    return signature(array_of_lanes(kind.ndim - 1) if kind.ndim > 1 else LANE, kind)


@defines(as_lanes, _type_as_lanes, (types.Array,))
def _as_lanes(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    from numba.np import arrayobj  # only the compiler needs it

    numbers = arrayobj.make_array(sig.args[0])(context, builder, value=args[0])
    data = builder.bitcast(numbers.data, LANE_VECTOR.as_pointer())
    if sig.return_type == LANE:
        return builder.load(data, align=1)
    shape, strides = (cgutils.unpack_tuple(builder, p) for p in (numbers.shape, numbers.strides))
    return array_over(context, builder, sig.return_type, data, shape[:-1], strides[:-1], 8 * WIDTH)


def _type_as_numbers(kind: Any) -> Any:
    is_array = isinstance(kind, types.Array) and kind.dtype in (LANE, types.float64)
    if not is_array or kind.layout != "C":
        return None
    return signature(types.Array(types.float64, kind.ndim + 1, "C"), kind)


@defines(as_numbers, _type_as_numbers, (types.Array,))
def _as_numbers(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    from numba.np import arrayobj  # only the compiler needs it

    wide = arrayobj.make_array(sig.args[0])(context, builder, value=args[0])
    width = WIDTH if sig.args[0].dtype == LANE else 1
    shape, strides = (cgutils.unpack_tuple(builder, part) for part in (wide.shape, wide.strides))
    data = builder.bitcast(wide.data, DOUBLE.as_pointer())
    shape, strides = [*shape, cgutils.intp_t(width)], [*strides, cgutils.intp_t(8)]
    return array_over(context, builder, sig.return_type, data, shape, strides, 8)
