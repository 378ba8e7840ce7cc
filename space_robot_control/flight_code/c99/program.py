"""All functions, structs and constants of an export, found from its first kernels on."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from types import FunctionType
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record

from .functions import Function, LengthNeeded, kind_of_argument, passed, syntax_of, translated
from .language import (
    ATOM,
    PREFIX,
    Bundle,
    Field,
    Known,
    NotInSubsetError,
    Refusal,
    TupleOf,
    Type,
    Value,
)

FIELD = re.compile(
    "\N{LEFT-POINTING DOUBLE ANGLE QUOTATION MARK}(\\d+):(\\w+)"
    "\N{RIGHT-POINTING DOUBLE ANGLE QUOTATION MARK}"
)
CALL, CONSTANT = re.compile("\N{CURRENCY SIGN}(\\d+)\\("), re.compile("\N{PILCROW SIGN}(\\d+);")


class Constant(NamedTuple):
    """A named number."""

    name: str
    number: float


class Program:
    """Translation of kernels and of all that they call.

    Functions are translated for the types of their arguments. Numbers that never change are known:
    a branch that they decide is left out, and so is what only that branch needs.
    """

    def __init__(self, sizes: Mapping[str, int], joints: int) -> None:
        """Begin.

        Args:
            sizes: numbers that stand for constants of modules, by name, as capacities of arrays.
            joints: n, of which the shapes of records are functions.
        """
        self.sizes, self.joints = dict(sizes), joints
        self.constants: dict[Field, float] = {}
        """Fields that never change; of an array, all of its numbers are the same."""
        self.functions: list[Function] = []
        self.modules: dict[Constant, str] = {}
        """First module that reads each constant."""
        self.tuples: dict[TupleOf, str] = {}
        self._known: dict[Any, int] = {}
        self._lengths: dict[tuple[Any, tuple[Type, ...]], set[str]] = {}
        self._named: dict[Constant, int] = {}
        self._records: dict[int, type[Record]] = {}
        self._active: list[Any] = []

    def shape(self, record: type[Record], name: str) -> tuple[int, ...]:
        """Return the shape of a field under the sizes."""
        self._records[id(record)] = record
        declared = record.fields()[name]
        assert isinstance(declared, RecordField)
        shape: Any = declared.shape
        resized = FunctionType(
            shape.__code__, {**shape.__globals__, **self.sizes}, None, None, shape.__closure__
        )
        numbers: tuple[int, ...] = tuple(resized(self.joints))
        return numbers

    def constant(self, field: Field) -> float | None:
        """Return the number of a field that never changes; None if it does."""
        return self.constants.get(field)

    def named(self, module: str, name: str, number: float) -> str:
        """Return the text of a module's constant."""
        constant = Constant(name, number)
        self.modules.setdefault(constant, module)
        return f"\N{PILCROW SIGN}{self._named.setdefault(constant, len(self._named))};"

    def struct_name(self, record: type[Record]) -> str:
        """Return the name of a record's struct."""
        self._records[id(record)] = record
        name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", record.__name__).lower()
        if name in ("gains", "memory"):  # of a law
            name = f"{record.__module__.rpartition('.')[2]}_{name}"
        return f"{PREFIX}{name}"

    def tuple_name(self, kind: TupleOf) -> str:
        """Return the name of a tuple's struct."""
        if kind not in self.tuples:
            for item in kind.items:
                if isinstance(item, TupleOf):
                    self.tuple_name(item)
            if kind.is_uniform:
                name = f"{PREFIX}tuple_{len(kind.items)}"
            else:
                parts = (
                    self.tuple_name(i).rpartition("_")[2] if isinstance(i, TupleOf) else i.name[0]
                    for i in kind.items
                )
                name = f"{PREFIX}tuple_{''.join(parts)}"
            self.tuples[kind] = name
        return self.tuples[kind]

    def call(self, body: Callable[..., Any], arguments: tuple[Value, ...], inside: Any) -> Value:
        """Return the call of a kernel by a translation, ``inside`` which it stands."""
        function = self.function(body, arguments, getattr(inside, "label", ""))
        written = {p.name for p in function.parameters if p.is_written}
        for names, argument in zip(function.arguments, arguments, strict=True):
            is_bundle = isinstance(argument.type, Bundle)
            parts = zip(argument.type.items, argument.parts) if is_bundle else ()
            for (item, _), part in parts:
                if any(name.endswith(f"_{item}") for name in written & set(names)):
                    inside.write(part)
            if not is_bundle and written & set(names):
                inside.write(argument)
        texts = ", ".join(passed(function, arguments, inside))
        number = self.functions.index(function)
        text = f"\N{CURRENCY SIGN}{number}({texts})"
        return Value(function.result, text, ATOM, calls=True)

    def function(
        self, body: Callable[..., Any], arguments: tuple[Value, ...], label: str = ""
    ) -> Function:
        """Return the translation of a kernel for arguments."""
        tree, file = syntax_of(body)
        names = [argument.arg for argument in tree.args.args]
        if len(names) != len(arguments):
            raise Refusal(f"a call of {tree.name}() with {len(arguments)} arguments", "give all")
        labels = [a.type.label for a in arguments if isinstance(a.type, Bundle)]
        is_bound = any(
            a.is_bound or isinstance(a.type, Known) or getattr(a.type, "shape", None) == (0,)
            for a in arguments
        )
        label = labels[0] if labels else label if is_bound else ""
        lengths = self._lengths.setdefault(body, set())
        while True:
            kinds = tuple(
                kind_of_argument(value, name, lengths)
                for value, name in zip(arguments, names, strict=True)
            )
            known = self._known.get((body, kinds))
            if known is not None:
                return self.functions[known]
            if body in self._active:
                line = body.__code__.co_firstlineno
                raise NotInSubsetError(file, line, "recursion", "write a loop")
            self._active.append(body)
            try:
                function = translated(self, body, kinds, label, set(lengths))
            except LengthNeeded as needed:
                lengths.add(str(needed))
                continue
            finally:
                self._active.pop()
            self.functions.append(function)
            self._known[body, kinds] = len(self.functions) - 1
            return function

    def reachable(self, first: Iterable[Function]) -> list[Function]:
        """Return the functions that are called from the ``first`` ones, callees first."""
        found: list[Function] = []

        def visit(function: Function) -> None:
            if function in found:
                return
            for number in CALL.findall("\n".join(function.lines)):
                visit(self.functions[int(number)])
            found.append(function)

        for function in first:
            visit(function)
        return found

    def fields_of(self, functions: Iterable[Function]) -> set[Field]:
        """Return the fields that functions read or write."""
        text = "\n".join("\n".join(function.lines) for function in functions)
        return {Field(self._records[int(number)], name) for number, name in FIELD.findall(text)}

    @staticmethod
    def written_fields(functions: Iterable[Function]) -> set[Field]:
        """Return the fields that functions write."""
        return {field for function in functions for field in function.stores}

    def constants_of(self, functions: Iterable[Function]) -> list[Constant]:
        """Return the constants that functions read."""
        text = "\n".join("\n".join(function.lines) for function in functions)
        numbers = {int(number) for number in CONSTANT.findall(text)}
        return [c for c, number in self._named.items() if number in numbers]

    def final(self, text: str, names: Mapping[int, str], constants: Mapping[int, str]) -> str:
        """Return the text with the names of fields, functions and constants."""
        text = FIELD.sub(lambda m: m[2], text)
        text = CALL.sub(lambda m: f"{names[int(m[1])]}(", text)
        return CONSTANT.sub(lambda m: constants[int(m[1])], text)

    def number_of_constant(self, constant: Constant) -> int:
        """Return the number of a constant in markers."""
        return self._named[constant]


def same_number(values: Any) -> float | None:
    """Return the number that all numbers of an array are; None if they differ."""
    numbers = np.asarray(values, dtype=np.float64).reshape(-1)
    if numbers.size and np.all(numbers == numbers[0]):
        return float(numbers[0])
    return None
