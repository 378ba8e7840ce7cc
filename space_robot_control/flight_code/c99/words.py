"""Functions of the kernels' language and their counterparts in C, with the same bits.

Each is exact in IEEE arithmetic, so C's library cannot differ: square root, remainder, rounding to
an integer, sign. Where Python, Numba and C differ (minimum and maximum of NaN, the sign of an
integer division, an integer from a large float) ``templates/kernels.h.j2`` has what Numba does.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import reduce
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled import lanes

from . import language as lang
from .language import RefusedError, Value, cast, number_of

Word = Callable[[tuple[Value, ...]], Value]


def _exact(name: str, kind: Any = lang.FLOAT) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        texts = ", ".join(cast(argument, lang.FLOAT).text for argument in arguments)
        return Value(kind, f"{name}({texts})", lang.ATOM, calls=max(a.calls for a in arguments))

    return word


def _absolute(arguments: tuple[Value, ...]) -> Value:
    if arguments[0].type != lang.FLOAT:
        raise RefusedError("abs() of an integer", "write a conditional expression")
    return _exact("fabs")(arguments)


def _extreme(name: str) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        kind = reduce(lang.joined, (argument.type for argument in arguments))
        calls = max(argument.calls for argument in arguments)
        pair = Value(kind, f"{name}{'_int' if kind == lang.INT else ''}", calls=calls)
        values = [cast(argument, kind) for argument in arguments]
        if all(value.constant is not None for value in values):
            function = max if name == "py_max" else min
            return number_of(function(value.constant for value in values))
        return reduce(lambda a, b: replace(pair, text=f"{pair.text}({a.text}, {b.text})"), values)

    return word


def _integer(arguments: tuple[Value, ...]) -> Value:
    (value,) = arguments
    if value.type == lang.INT:
        return value
    if value.constant is not None:
        return number_of(int(value.constant))
    if value.type == lang.BOOL:
        return cast(value, lang.INT)
    return replace(value, type=lang.INT, text=f"py_int({value.text})", rank=lang.ATOM)


def negated(arguments: tuple[Value, ...]) -> Value:
    """Return ``not x``."""
    value = cast(arguments[0], lang.BOOL)
    constant = None if value.constant is None else not value.constant
    return replace(value, text=f"!{value.at(lang.UNARY)}", rank=lang.UNARY, constant=constant)


def chosen(arguments: tuple[Value, ...]) -> Value:
    """Return ``then if condition else otherwise``."""
    condition, then, otherwise = arguments
    condition = cast(condition, lang.BOOL)
    kind = lang.joined(then.type, otherwise.type)
    if not isinstance(kind, lang.TupleOf):
        then, otherwise = cast(then, kind), cast(otherwise, kind)
    if condition.constant is not None:
        return then if condition.constant else otherwise
    if then.text == otherwise.text:
        return then
    calls = max(condition.calls, then.calls, otherwise.calls)
    both = f"{then.at(lang.TERNARY + 1)} : {otherwise.at(lang.TERNARY + 1)}"
    text = f"{condition.at(lang.UNARY)} ? {both}"
    return Value(kind, text, lang.TERNARY, calls=calls)


WORDS: dict[Any, Word] = {
    abs: _absolute,
    min: _extreme("py_min"),
    max: _extreme("py_max"),
    int: _integer,
    float: lambda a: cast(a[0], lang.FLOAT),
    bool: lambda a: cast(a[0], lang.BOOL),
    math.sqrt: _exact("sqrt"),
    np.sqrt: _exact("sqrt"),
    np.floor: _exact("floor"),
    np.fmod: _exact("fmod"),
    math.copysign: _exact("copysign"),
    np.copysign: _exact("copysign"),
    np.sign: _exact("py_sign"),
    np.isfinite: _exact("py_isfinite", lang.BOOL),
    np.isnan: _exact("py_isnan", lang.BOOL),
    math.isnan: _exact("py_isnan", lang.BOOL),
    lanes.where: chosen,
    lanes.uniform: lambda a: a[0],
    lanes.whole: _integer,
    lanes.any_lane: lambda a: cast(a[0], lang.BOOL),
    lanes.all_lanes: lambda a: cast(a[0], lang.BOOL),
    lanes.negated: negated,
}
"""Functions that kernels may call beside one another."""
