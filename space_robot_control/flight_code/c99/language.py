"""Types, values and functions of the kernels' language, and how they are written in C.

The functions that kernels may call beside one another are exact in IEEE arithmetic, so C's library
cannot differ: square root, remainder, rounding to an integer, sign. Where Python, Numba and C
differ (minimum and maximum of NaN, the sign of an integer division, an integer from a large float)
``templates/kernels.h.j2`` has what Numba does.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass, replace
from functools import reduce
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.compiled import lanes
from space_robot_msgs_py.compiled.records import Record
from space_robot_msgs_py.errors import InputError

WRITES = 2
"""See `Value.calls`."""
PREFIX = "sr_"
"""Of every name that a linker sees."""
TERNARY, OR, AND, BITS, EQUAL, RELATION, SHIFT, SUM, PRODUCT, UNARY, POSTFIX, ATOM = range(12)
"""Ranks of C's operators; a higher one binds tighter."""


class NotInSubsetError(InputError):
    """A construct that has no translation to C."""

    def __init__(self, file: str, line: int, construct: str, instead: str) -> None:
        """Name the place, the construct, and what to write instead."""
        super().__init__(f"{file}, line {line}: {construct} cannot be exported as C: {instead}")


class RefusedError(Exception):
    """A construct is refused; the place is added by the caller who knows it."""

    def __init__(self, construct: str, instead: str) -> None:
        super().__init__(construct)
        self.construct, self.instead = construct, instead


@dataclass(frozen=True)
class Scalar:
    """A number or truth value."""

    name: str
    """In C."""


FLOAT, INT, UINT, BOOL, VOID = map(Scalar, ("double", "int64_t", "uint64_t", "bool", "void"))


@dataclass(frozen=True)
class TupleOf:
    """A tuple; a struct in C."""

    items: tuple[Any, ...]

    @property
    def is_uniform(self) -> bool:
        """Whether all items are floats: then the struct has an array."""
        return all(item == FLOAT for item in self.items)


@dataclass(frozen=True)
class ArrayOf:
    """An array of numbers of one type."""

    shape: tuple[int | None, ...]
    """Only the first dimension may be unknown."""
    item: Scalar = FLOAT
    is_local: bool = False
    """Whether it is a function's own, made with ``np.zeros``."""
    is_table: bool = False
    """Whether its numbers are constant."""


@dataclass(frozen=True)
class Pointer:
    """A record; in C a pointer to a struct."""

    record: type[Record]


@dataclass(frozen=True)
class BlockOf:
    """An array of one record, whose only use is ``block[0]``."""

    record: type[Record]


EMPTY = ArrayOf((0,))
"""What stands for an array that a law does not have."""


class Known:
    """An object that is bound when the code is exported: a function, a module, a number."""

    def __init__(self, value: Any) -> None:
        self.value = value

    def _identity(self) -> Any:
        is_number = isinstance(self.value, (bool, int, float, str))
        return (type(self.value), self.value) if is_number else id(self.value)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, Known) and self._identity() == other._identity()

    def __hash__(self) -> int:
        return hash(self._identity())


@dataclass(frozen=True)
class FieldOf:
    """An item of a bundle that is a field of another one."""

    item: str
    name: str


@dataclass(frozen=True)
class Bundle:
    """A named tuple whose items are bound, or are arguments of their own in C."""

    label: str
    """Distinguishes the functions made for it."""
    items: tuple[tuple[str, Any], ...]
    """Names and types."""


Type = Any


class FieldName(NamedTuple):
    """A field of a record."""

    record: type[Record]
    name: str


@dataclass(frozen=True)
class Value:
    """A translated expression."""

    type: Type
    text: str = ""
    rank: int = ATOM
    constant: Any = None
    """Its number, if it is known when the code is exported; the text reads it all the same."""
    roots: frozenset[str] = frozenset()
    """Local names through which its memory is reached."""
    fields: frozenset[FieldName] = frozenset()
    """Of an array or number in a record: its field."""
    offset: str = ""
    """Of an array: index of its first number in ``text``."""
    is_pointer: bool = True
    """Of a record: whether the text is a pointer."""
    calls: int = 0
    """1: evaluating it calls a kernel; 2: one that writes memory."""
    is_bound: bool = False
    """Whether its constant is bound when the code is exported: no argument in C."""
    parts: tuple[Value, ...] = ()
    """Of a bundle: its items."""

    def at(self, rank: int) -> str:
        """Return the text for a place that needs at least a rank."""
        return self.text if self.rank >= rank else f"({self.text})"

    @property
    def address(self) -> str:
        """The text of an array or record as an argument."""
        if isinstance(self.type, ArrayOf) and self.offset:
            return f"&{self.text}[{self.offset}]"
        if isinstance(self.type, Pointer) and not self.is_pointer:
            return f"&{self.text}"
        return self.text


class C99:
    """What of the text is C99's own; another target is a subclass with its differences."""

    local_function = "static "
    """Before the head of a function that only its own file calls."""
    shared_function = ""
    """Before that of any other one."""

    table = "static const double"
    """Before the name of a table of numbers."""

    def tuple_of(self, name: str, items: str, is_uniform: bool) -> str:
        """Return a value of the struct ``name`` that stands for a tuple."""
        return f"({name}){{{{{items}}}}}" if is_uniform else f"({name}){{{items}}}"


def literal(number: float) -> str:
    """Return a number in C, with all its bits."""
    if isinstance(number, bool):
        return "true" if number else "false"
    if isinstance(number, np.uint64):
        return f"UINT64_C({number})"
    if isinstance(number, int):
        return str(number) if abs(number) < 2**31 else f"INT64_C({number})"
    if math.isnan(number):
        return "(double)NAN"
    if math.isinf(number):
        return "(double)INFINITY" if number > 0 else "-(double)INFINITY"
    text = repr(float(number))  # the shortest text that reads back as the same bits
    return text if any(c in text for c in ".e") else f"{text}.0"


def number_of(number: Any) -> Value:
    """Return the value of a number."""
    kinds = {bool: BOOL, int: INT, np.uint64: UINT}
    kind = kinds.get(type(number), FLOAT)
    text = literal(number)
    return Value(kind, text, UNARY if text.startswith(("-", "(")) else ATOM, number)


def check_order(values: Iterable[Value]) -> None:
    """Check that it does not matter which of some values C evaluates first.

    Raises:
        RefusedError: a kernel that writes is called beside other values that may depend on it.
    """
    reading = [v for v in values if v.calls or "[" in v.text or "." in v.text or ">" in v.text]
    if len(reading) > 1 and any(v.calls == WRITES for v in reading):
        raise RefusedError("a kernel that writes, beside other values", "name its result first")


def cast(value: Value, kind: Type) -> Value:
    """Return a value converted to a scalar type, as Numba does."""
    if value.type == kind:
        return value
    constant = value.constant
    if kind == FLOAT and value.type == INT:
        if constant is not None and value.text.lstrip("-").isdigit():
            return number_of(float(constant))
        text = f"(double){value.at(UNARY)}"
        number = None if constant is None else float(constant)
        return replace(value, type=FLOAT, text=text, rank=UNARY, constant=number)
    if {kind, value.type} == {INT, UINT}:  # by a word, see `WORDS`: Python has no other way
        if constant is not None:
            return number_of(np.uint64(constant) if kind == UINT else int(constant))
        return replace(value, type=kind, text=f"({kind.name}){value.at(UNARY)}", rank=UNARY)
    if kind in (FLOAT, INT, UINT) and value.type == BOOL:
        one, zero = ("1.0", "0.0") if kind == FLOAT else ("1", "0")
        number = None if constant is None else float(constant) if kind == FLOAT else int(constant)
        text = f"{value.at(UNARY)} ? {one} : {zero}"
        return replace(value, type=kind, text=text, rank=TERNARY, constant=number)
    if kind == BOOL and value.type in (FLOAT, INT):
        zero = "0.0" if value.type == FLOAT else "0"
        known = None if constant is None else constant != 0
        text = f"{value.at(RELATION)} != {zero}"
        return replace(value, type=BOOL, text=text, rank=EQUAL, constant=known)
    both = f"{described(value.type)} where {described(kind)} is needed"
    raise RefusedError(both, "give every name one type")


def joined(one: Type, other: Type) -> Type:
    """Return the type that holds values of both, as Numba unifies them."""
    if one == other or other is None:
        return one
    if one is None:
        return other
    if {one, other} <= {FLOAT, INT}:
        return FLOAT
    # arrays of different lengths: a pointer to the first row fits both
    are_arrays = isinstance(one, ArrayOf) and isinstance(other, ArrayOf)
    if are_arrays and one.shape[1:] == other.shape[1:]:
        return ArrayOf((None, *one.shape[1:]))
    both = f"{described(one)} and {described(other)}"
    raise RefusedError(f"one name for {both}", "use a name for each type")


def described(kind: Type) -> str:
    """Return a type in words."""
    if isinstance(kind, Scalar):
        words = {
            "double": "a float",
            "int64_t": "an integer",
            "uint64_t": "an unsigned integer",
            "bool": "a bool",
        }
        return words.get(kind.name, "nothing")
    if isinstance(kind, Known):
        return f"the Python object {getattr(kind.value, '__name__', kind.value)!r}"
    words_of = {TupleOf: "a tuple", ArrayOf: "an array", Pointer: "a record", BlockOf: "a block"}
    return words_of.get(type(kind), "a named tuple")


Word = Callable[[tuple[Value, ...]], Value]


def _exact(name: str, kind: Any = FLOAT) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        texts = ", ".join(cast(argument, FLOAT).text for argument in arguments)
        return Value(kind, f"{name}({texts})", ATOM, calls=max(a.calls for a in arguments))

    return word


def _absolute(arguments: tuple[Value, ...]) -> Value:
    if arguments[0].type != FLOAT:
        raise RefusedError("abs() of an integer", "write a conditional expression")
    return _exact("fabs")(arguments)


def _extreme(name: str) -> Word:
    def word(arguments: tuple[Value, ...]) -> Value:
        kind = reduce(joined, (argument.type for argument in arguments))
        calls = max(argument.calls for argument in arguments)
        pair = Value(kind, f"{name}{'_int' if kind == INT else ''}", calls=calls)
        values = [cast(argument, kind) for argument in arguments]
        if all(value.constant is not None for value in values):
            function = max if name == "py_max" else min
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
    return replace(value, type=INT, text=f"py_int({value.text})", rank=ATOM)


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
    calls = max(condition.calls, then.calls, otherwise.calls)
    both = f"{then.at(TERNARY + 1)} : {otherwise.at(TERNARY + 1)}"
    text = f"{condition.at(UNARY)} ? {both}"
    return Value(kind, text, TERNARY, calls=calls)


WORDS: dict[Any, Word] = {
    abs: _absolute,
    min: _extreme("py_min"),
    max: _extreme("py_max"),
    int: _integer,
    float: lambda a: cast(a[0], FLOAT),
    bool: lambda a: cast(a[0], BOOL),
    np.uint64: lambda a: cast(a[0], UINT),
    np.int64: lambda a: cast(a[0], INT),
    math.sqrt: _exact("sqrt"),
    np.sqrt: _exact("sqrt"),
    np.floor: _exact("floor"),
    np.fmod: _exact("fmod"),
    math.ldexp: lambda a: replace(
        _exact("py_ldexp")(a[:1]), text=f"py_ldexp({a[0].text}, {cast(a[1], INT).text})"
    ),
    math.copysign: _exact("copysign"),
    np.copysign: _exact("copysign"),
    np.sign: _exact("py_sign"),
    np.isfinite: _exact("py_isfinite", BOOL),
    np.isnan: _exact("py_isnan", BOOL),
    math.isnan: _exact("py_isnan", BOOL),
    lanes.where: chosen,
    lanes.uniform: lambda a: a[0],
    lanes.whole: _integer,
    lanes.any_lane: lambda a: cast(a[0], BOOL),
    lanes.all_lanes: lambda a: cast(a[0], BOOL),
    lanes.negated: negated,
    lanes.lane_of: lambda a: a[0],
}
"""Functions that kernels may call beside one another."""
