"""One kernel, for one set of argument types, as a function of C."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from typing import Any

from .language import (
    BOOL,
    FLOAT,
    INT,
    NOTHING,
    ArrayOf,
    BlockOf,
    Bundle,
    Field,
    Known,
    NotInSubsetError,
    Pointer,
    Refusal,
    TupleOf,
    Type,
    Value,
    number_of,
)
from .statements import Statements

MOST_PASSES = 5
"""Passes over a function until the types of its names have settled; two are usual."""


@dataclass(frozen=True)
class Parameter:
    """An argument in C."""

    name: str
    type: Type
    is_written: bool
    """Whether the memory that it points to is written."""


@dataclass(frozen=True)
class Function:
    """A translated kernel."""

    body: Callable[..., Any]
    """The kernel as plain Python."""
    label: str
    """Of a bundle that it was made for; empty if for none."""
    parameters: tuple[Parameter, ...]
    arguments: tuple[tuple[str, ...], ...]
    """Names of the parameters that each argument in Python becomes in C."""
    result: Type
    lines: tuple[str, ...]
    stores: frozenset[Field]
    """Fields of records that it writes."""

    @property
    def has_effects(self) -> bool:
        """Whether it writes memory."""
        return any(parameter.is_written for parameter in self.parameters)


@cache
def syntax_of(body: Callable[..., Any]) -> tuple[ast.FunctionDef, str]:
    """Return the syntax tree of a function, and its file from the project's root."""
    source = textwrap.dedent(inspect.getsource(body))
    tree = ast.parse(source).body[0]
    file = Path(inspect.getsourcefile(body) or "?")
    parts = file.parts
    start = next((k for k, part in enumerate(parts) if part.startswith("space_robot")), None)
    inside = [k for k, part in enumerate(parts) if part.startswith("space_robot_")] or [start]
    shown = "/".join(parts[inside[-1] :]) if inside[-1] is not None else str(file)
    if not isinstance(tree, ast.FunctionDef):
        line = body.__code__.co_firstlineno
        raise NotInSubsetError(shown, line, "a lambda", "write a kernel with def")
    return tree, shown


class _Translation(Statements):
    """Translation of one kernel for arguments of given types."""

    def __init__(
        self, program: Any, body: Callable[..., Any], kinds: tuple[Type, ...], lengths: set[str]
    ) -> None:
        tree, file = syntax_of(body)
        super().__init__(program, body, tree, file)
        self.lengths = lengths
        self.arguments: list[tuple[str, ...]] = []
        self.parameters: list[tuple[str, Type]] = []
        names = [argument.arg for argument in tree.args.args]
        if len(names) != len(kinds):
            raise Refusal(f"a call of {tree.name}() with {len(kinds)} arguments", "give them all")
        for name, kind in zip(names, kinds, strict=True):
            self.names[name] = self._parameter(name, kind)
            self.types[name] = kind

    def _parameter(self, name: str, kind: Type) -> Value:
        if getattr(kind, "shape", None) == (0,):  # C has no such arrays
            self.arguments.append(())
            return Value(kind, name)
        if isinstance(kind, Known):
            self.arguments.append(())
            is_number = isinstance(kind.value, (bool, int))
            return replace(number_of(kind.value), is_bound=True) if is_number else Value(kind, name)
        if isinstance(kind, Bundle):
            before = len(self.arguments)
            parts = tuple(self._parameter(f"{name}_{item}", of) for item, of in kind.items)
            inner = [n for group in self.arguments[before:] for n in group]
            self.arguments[before:] = [tuple(inner)]
            return Value(kind, name, parts=parts)
        self.parameters.append((name, kind))
        self.arguments.append((name,))
        size = ""
        if isinstance(kind, ArrayOf) and kind.shape[0] is None and name in self.lengths:
            size = f"{name}_size"
            self.parameters.append((size, INT))
            self.arguments[-1] = (name, size)
        return Value(kind, name, roots=frozenset({name}), size=size)

    def missing_length(self, array: Value) -> str:
        """Ask for the length of an argument."""
        if array.text in dict(self.parameters) and not array.offset:
            raise LengthNeeded(array.text)
        return super().missing_length(array)


class LengthNeeded(Exception):
    """A function reads the length of an argument."""


def translated(
    program: Any, body: Callable[..., Any], kinds: tuple[Type, ...], label: str, lengths: set[str]
) -> Function:
    """Translate a kernel.

    Args:
        program: the export that it is part of.
        body: the kernel as plain Python.
        kinds: types of its arguments.
        label: of the bundle that it is made for.
        lengths: arrays whose length it reads, or may.

    Raises:
        LengthNeeded: it reads the length of another one.
        NotInSubsetError: a construct has no translation.
    """
    types: dict[str, Type] = {}
    result: Type = None
    for _ in range(MOST_PASSES):
        translation = _Translation(program, body, kinds, lengths)
        translation.types |= types
        translation.result = result
        translation.body()
        if translation.types == types and translation.result == result:
            break
        types, result = dict(translation.types), translation.result
    written = set(translation.written)
    for name, value in translation.names.items():
        if isinstance(value.type, ArrayOf) and len(value.type.shape) > 1 and value.roots:
            written |= value.roots  # C99 has no pointers to constant rows from variable ones
    lines = _finished(translation, written)
    text = "\n".join(lines)
    parameters = tuple(
        Parameter(name, kind, name in written) for name, kind in translation.parameters
    )
    unused = [p for p in parameters if not re.search(rf"\b{p.name}\b", text)]
    own = {argument.arg for argument in translation.tree.args.args}
    dropped = {p.name for p in unused if p.name not in own}
    lines = [f"    (void){p.name};" for p in unused if p.name in own] + lines
    return Function(
        body,
        label,
        tuple(p for p in parameters if p.name not in dropped),
        tuple(tuple(n for n in names if n not in dropped) for names in translation.arguments),
        translation.result or NOTHING,
        tuple(lines),
        frozenset(translation.stores),
    )


def _finished(translation: _Translation, written: set[str]) -> list[str]:
    """Return the lines with constant pointers declared so, and without names nobody reads."""
    lines = list(translation.lines)
    declaration = re.compile("\N{SECTION SIGN}(\\w+)\N{SECTION SIGN}")
    for k in range(len(lines) - 1, -1, -1):
        match = declaration.search(lines[k])
        if match is None:
            continue
        name = match[1]
        kind = translation.types[name]
        is_pointer = isinstance(kind, (Pointer, BlockOf, ArrayOf))
        rest = "\n".join(lines[:k] + lines[k + 1 :])
        uses = len(re.findall(rf"(?<![\w.>]){name}\b", declaration.sub("", rest)))
        if uses == 0 and ("=" not in lines[k] or "(" not in lines[k].split("=", 1)[1]):
            del lines[k]
            continue
        qualifier = "const " if is_pointer and name not in written else ""
        lines[k] = declaration.sub(qualifier, lines[k])
    return lines


def passed(function: Function, arguments: tuple[Value, ...], inside: Statements) -> list[str]:
    """Return the texts of the arguments of a call."""
    texts: list[str] = []
    kinds = {p.name: p.type for p in function.parameters}
    for names, argument in zip(function.arguments, arguments, strict=True):
        if isinstance(argument.type, Bundle):
            given = _bundled(argument, inside)
            found = {name: next(t for end, t in given if name.endswith(end)) for name in names}
            assert all(found.values())
            texts += found.values()
        else:
            given = texts_of(argument, inside)[: len(names)]
            texts += [text or inside.missing_length(argument) for _, text in given]
    assert len(texts) == len(kinds)
    return texts


def _bundled(bundle: Value, inside: Statements) -> list[tuple[str, str]]:
    pairs = []
    for (name, _), part in zip(bundle.type.items, bundle.parts, strict=True):
        if not isinstance(part.type, Known):
            for suffix, text in texts_of(part, inside):
                pairs.append((f"_{name}{suffix}", text))
    return pairs


def texts_of(value: Value, inside: Statements) -> list[tuple[str, str]]:
    """Return an argument's text, and of an array that of its length."""
    if isinstance(value.type, ArrayOf):
        yield_size = value.type.shape[0] is not None or value.size
        size = inside.length(value).text if yield_size else ""
        return [("", value.address), ("_size", size)]
    is_memory = isinstance(value.type, (Pointer, BlockOf))
    return [("", value.address if is_memory else value.text)]


def kind_of_argument(value: Value, name: str, lengths: set[str]) -> Type:
    """Return the type of a parameter for an argument.

    An array's length is part of it only if the function reads it, so that arrays of different
    lengths share functions that do not.
    """
    kind = value.type
    if value.is_bound or (kind == BOOL and value.constant is not None):
        return Known(value.constant)
    if isinstance(kind, ArrayOf):
        first = (
            kind.shape[0] if name in lengths or len(kind.shape) > 1 or kind.shape[0] == 0 else None
        )
        return ArrayOf((first, *kind.shape[1:]))
    if isinstance(kind, Bundle):
        items = tuple(
            (item, kind_of_argument(part, f"{name}_{item}", lengths))
            for (item, _), part in zip(kind.items, value.parts, strict=True)
        )
        return Bundle(kind.label, items)
    if kind in (FLOAT, INT, BOOL) or isinstance(kind, (TupleOf, Known, Pointer, BlockOf)):
        return kind
    raise Refusal(f"the argument {name!r}", "pass numbers, arrays and records")
