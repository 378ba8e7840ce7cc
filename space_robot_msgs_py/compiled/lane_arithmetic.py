"""Arithmetic, comparisons and functions of numbers eight flights wide, for Numba."""

from __future__ import annotations

import math
import operator
from collections.abc import Callable
from typing import Any

import numpy as np
from llvmlite import ir
from numba.core import cgutils, types
from numba.core.imputils import lower_builtin
from numba.core.typing.templates import AbstractTemplate, infer_global, signature

from .lane_type import DOUBLE, INDEX, LANE, LANE_VECTOR, MASK, LaneType, MaskType
from .lanes import WIDTH

_Build = Callable[..., Any]


def _is_number(kind: Any) -> bool:
    return isinstance(kind, (types.Float, types.Integer, types.Literal))


def _some_lanes(args: Any) -> bool:
    return LANE in args and all(kind == LANE or _is_number(kind) for kind in args)


def _some_masks(args: Any) -> bool:
    return MASK in args and all(isinstance(kind, (MaskType, types.Boolean)) for kind in args)


def _define(function: Any, arity: int, result: Any, build: _Build, of: Any = LANE) -> None:
    """Define ``function`` of lanes, or masks, with the instructions emitted by ``build``."""
    accepts = _some_lanes if of is LANE else _some_masks

    class Pointwise(AbstractTemplate):
        key = function

        def generic(self, args: Any, kws: Any) -> Any:
            if len(args) == arity and not kws and accepts(args):
                return signature(result, *[of] * arity)
            return None

    def lower(context: Any, builder: Any, sig: Any, args: Any) -> Any:
        return build(builder, *args)

    infer_global(function)(Pointwise)
    lower_builtin(function, *[type(of)] * arity)(lower)


def _intrinsic(name: str, arity: int = 1) -> _Build:
    """Return an emitter of a vector function of LLVM."""

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


def _define_all(
    functions: dict[Any, _Build], arity: int, result: Any = LANE, of: Any = LANE
) -> None:
    for names, build in functions.items():
        for function in names if isinstance(names, tuple) else (names,):
            _define(function, arity, result, build, of)


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


@infer_global(math.frexp)
class _Exponent(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(types.UniTuple(LANE, 2), LANE) if args == (LANE,) else None


@lower_builtin(math.frexp, LaneType)
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


@infer_global(np.fmod)
class _Remainder(AbstractTemplate):
    def generic(self, args: Any, kws: Any) -> Any:
        return signature(LANE, LANE, LANE) if _some_lanes(args) else None


@lower_builtin(np.fmod, LaneType, LaneType)
def _remainder(context: Any, builder: Any, sig: Any, args: Any) -> Any:
    """Emit the function of plain numbers lane by lane: it is rare."""
    plain = signature(types.float64, types.float64, types.float64)
    function = context.get_function(np.fmod, plain)
    total = ir.Constant(LANE_VECTOR, ir.Undefined)
    for k in range(WIDTH):
        one = function(builder, [builder.extract_element(value, INDEX(k)) for value in args])
        total = builder.insert_element(total, one, INDEX(k))
    return total
