"""Functions of the kernels' language and their counterparts in C, with the same bits.

Each is exact in IEEE arithmetic, so C's library cannot differ: square root, remainder, rounding to
an integer, sign and exponent. Where Python, Numba and C differ (minimum and maximum of NaN, the sign
of an integer division, an integer from a large float) `SUPPORT` has the function of Numba's result.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled import lanes

from .language import (
    ATOM,
    BOOL,
    FLOAT,
    INT,
    OR,
    TERNARY,
    UNARY,
    Refusal,
    TupleOf,
    Value,
    cast,
    joined,
    number_of,
)

SUPPORT = """\
/* Operations as the kernels have them in Python; see README.md. */

/* The larger one; the first if they are equal or the second is NaN. */
static inline double sr_max(double a, double b) { return (b > a) ? b : a; }

/* The smaller one; the first if they are equal or the second is NaN. */
static inline double sr_min(double a, double b) { return (b < a) ? b : a; }

static inline int64_t sr_max_int(int64_t a, int64_t b) { return (b > a) ? b : a; }

static inline int64_t sr_min_int(int64_t a, int64_t b) { return (b < a) ? b : a; }

/* 1, -1, or 0 for either zero; NaN of NaN. */
static inline double sr_sign(double x)
{
    return (x > 0.0) ? 1.0 : ((x < 0.0) ? -1.0 : ((x == 0.0) ? 0.0 : x));
}

static inline bool sr_isfinite(double x) { return fabs(x) <= DBL_MAX; }

static inline bool sr_isnan(double x) { return !(x == x); }

/* The integer towards zero; the least integer for NaN and beyond the range, where C has none. */
static inline int64_t sr_int(double x)
{
    return (fabs(x) <= 9.223372036854774784e18) ? (int64_t)x : INT64_MIN;
}

/* The remainder with the sign of the divisor, and the quotient rounded down; 0 for divisor 0. */
static inline int64_t sr_modulo(int64_t a, int64_t b)
{
    const int64_t rest = ((b == 0) || (b == -1)) ? 0 : (a % b);
    return ((rest != 0) && ((rest < 0) != (b < 0))) ? (rest + b) : rest;
}

static inline int64_t sr_floor_divide(int64_t a, int64_t b)
{
    return (b == 0) ? 0 : ((b == -1) ? -a : ((a - sr_modulo(a, b)) / b));
}
"""

Word = Callable[[tuple[Value, ...]], Value]


def _exact(name: str, kind: Any = FLOAT) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        texts = ", ".join(cast(argument, FLOAT).text for argument in arguments)
        return Value(kind, f"{name}({texts})", ATOM, calls=any(a.calls for a in arguments))

    return word


def _absolute(arguments: tuple[Value, ...]) -> Value:
    if arguments[0].type != FLOAT:
        raise Refusal("abs() of an integer", "write a conditional expression")
    return _exact("fabs")(arguments)


def _extreme(name: str) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        kind = reduce(joined, (argument.type for argument in arguments))
        pair = Value(kind, f"{name}{'_int' if kind == INT else ''}")
        values = [cast(argument, kind) for argument in arguments]
        if all(value.constant is not None for value in values):
            function = max if name == "sr_max" else min
            return number_of(function(value.constant for value in values))
        return reduce(lambda a, b: replace(pair, text=f"{pair.text}({a.text}, {b.text})"), values)

    return word


def _integer(arguments: tuple[Value, ...]) -> Value:
    (value,) = arguments
    if value.type == INT:
        return value
    if value.constant is not None:
        return number_of(int(value.constant))
    if value.type == BOOL:
        return cast(value, INT)
    return replace(value, type=INT, text=f"sr_int({value.text})", rank=ATOM)


def _float(arguments: tuple[Value, ...]) -> Value:
    return cast(arguments[0], FLOAT)


def _bool(arguments: tuple[Value, ...]) -> Value:
    return cast(arguments[0], BOOL)


def _itself(arguments: tuple[Value, ...]) -> Value:
    return arguments[0]


def negated(arguments: tuple[Value, ...]) -> Value:
    """Return ``not x``."""
    value = cast(arguments[0], BOOL)
    constant = None if value.constant is None else not value.constant
    return replace(value, text=f"!{value.at(UNARY)}", rank=UNARY, constant=constant)


def chosen(arguments: tuple[Value, ...]) -> Value:
    """Return ``then if condition else otherwise``."""
    condition, then, otherwise = arguments
    condition = cast(condition, BOOL)
    kind = joined(then.type, otherwise.type)
    if not isinstance(kind, TupleOf):
        then, otherwise = cast(then, kind), cast(otherwise, kind)
    if condition.constant is not None:
        return then if condition.constant else otherwise
    if then.text == otherwise.text:
        return then
    calls = condition.calls or then.calls or otherwise.calls
    text = f"{condition.at(UNARY)} ? {then.at(TERNARY + 1)} : {otherwise.at(TERNARY + 1)}"
    return Value(kind, text, TERNARY, calls=calls)


WORDS: dict[Any, Word] = {
    abs: _absolute,
    min: _extreme("sr_min"),
    max: _extreme("sr_max"),
    int: _integer,
    float: _float,
    bool: _bool,
    math.sqrt: _exact("sqrt"),
    np.sqrt: _exact("sqrt"),
    np.floor: _exact("floor"),
    np.fmod: _exact("fmod"),
    math.copysign: _exact("copysign"),
    np.copysign: _exact("copysign"),
    np.sign: _exact("sr_sign"),
    np.isfinite: _exact("sr_isfinite", BOOL),
    np.isnan: _exact("sr_isnan", BOOL),
    math.isnan: _exact("sr_isnan", BOOL),
    lanes.where: chosen,
    lanes.uniform: _itself,
    lanes.whole: _integer,
    lanes.any_lane: _bool,
    lanes.all_lanes: _bool,
    lanes.negated: negated,
}
"""Functions that kernels may call beside one another."""
