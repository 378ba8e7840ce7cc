"""All functions, structs and constants of an export, found from its first kernels on."""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import replace
from types import FunctionType
from typing import Any, NamedTuple

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record

from . import language as lang
from .functions import Function, kind_of_argument, passed, syntax_of, translated
from .language import RefusedError, Value

FIELD, CALL, CONSTANT = map(re.compile, (r"«(\d+):(\w+)»", r"¤(\d+)\(", r"¶(\d+);"))
"""Markers of fields, calls and constants, whose names are decided at the end."""


def _names(function: Function) -> list[tuple[str, bool]]:
    return [(p.name, p.is_written) for p in function.parameters]


class Constant(NamedTuple):
    """A named number."""

    name: str
    number: float


class KernelProgram:
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
        self.constants: dict[lang.FieldName, float] = {}
        """Fields that never change; of an array, all of its numbers are the same."""
        self.functions: list[Function] = []
        self.named_numbers: dict[Constant, int] = {}
        """Named numbers, and their places in markers."""
        self.modules: dict[Constant, str] = {}
        """First module that reads each of them."""
        self.records: dict[int, type[Record]] = {}
        """Records by their places in markers."""
        self.tuples: dict[lang.TupleOf, str] = {}
        self._known: dict[Any, int] = {}
        self._active: list[Any] = []

    def shape(self, record: type[Record], name: str) -> tuple[int, ...]:
        """Return the shape of a field under the sizes."""
        self.records[id(record)] = record
        declared = record.fields()[name]
        assert isinstance(declared, RecordField)
        shape: Any = declared.shape
        resized = FunctionType(
            shape.__code__, {**shape.__globals__, **self.sizes}, None, None, shape.__closure__
        )
        numbers: tuple[int, ...] = tuple(resized(self.joints))
        return numbers

    def named(self, module: str, name: str, number: float) -> str:
        """Return the text of a module's constant."""
        constant = Constant(name, number)
        self.modules.setdefault(constant, module)
        return f"¶{self.named_numbers.setdefault(constant, len(self.named_numbers))};"

    def struct_name(self, record: type[Record]) -> str:
        """Return the name of a record's struct."""
        self.records[id(record)] = record
        name = re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", record.__name__).lower()
        if name in ("gains", "memory"):  # of a law
            name = f"{record.__module__.rpartition('.')[2]}_{name}"
        return f"{lang.PREFIX}{name}"

    def tuple_name(self, kind: lang.TupleOf) -> str:
        """Return the name of a tuple's struct."""
        if kind not in self.tuples:
            inner = [
                self.tuple_name(i).rpartition("_")[2] if isinstance(i, lang.TupleOf) else i.name[0]
                for i in kind.items
            ]
            name = str(len(inner)) if kind.is_uniform else "".join(inner)
            self.tuples[kind] = f"{lang.PREFIX}tuple_{name}"
        return self.tuples[kind]

    def call(self, body: Callable[..., Any], arguments: tuple[Value, ...], inside: Any) -> Value:
        """Return the call of a kernel by a translation, ``inside`` which it stands."""
        number = self.function(body, arguments)
        function = self.functions[number]
        calls, values = 1, passed(function, arguments)
        for parameter, value in zip(function.parameters, values, strict=True):
            if parameter.is_written:
                inside.write(value)
                calls = lang.WRITES
        text = f"¤{number}({', '.join(value.address for value in values)})"
        return Value(function.result, text, calls=calls)

    def function(self, body: Callable[..., Any], arguments: tuple[Value, ...]) -> int:
        """Return the number of the translation of a kernel for arguments.

        Translations that differ only in the lengths of arrays that they do not read are one.
        """
        tree, file = syntax_of(body)
        if len(tree.args.args) != len(arguments):
            raise RefusedError(f"a call of {tree.name}() without all arguments", "give them all")
        kinds = tuple(map(kind_of_argument, arguments))
        if (body, kinds) in self._known:
            return self._known[body, kinds]
        if body in self._active:
            line = body.__code__.co_firstlineno
            raise lang.NotInSubsetError(file, line, "recursion", "write a loop")
        labels = [kind.label for kind in kinds if isinstance(kind, lang.Bundle)]
        self._active.append(body)
        new = translated(self, body, kinds, labels[0] if labels else "")
        self._active.pop()
        number = len(self.functions)
        for k, old in enumerate(self.functions):
            if old.body is body and old.lines == new.lines and _names(old) == _names(new):
                pairs = zip(old.parameters, new.parameters, strict=True)
                merged = tuple(replace(p, type=lang.joined(p.type, q.type)) for p, q in pairs)
                self.functions[k] = replace(old, parameters=merged)
                number = k
                break
        else:
            self.functions.append(new)
        self._known[body, kinds] = number
        return number
