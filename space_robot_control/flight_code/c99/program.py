"""All functions, structs and constants of an export, found from its first kernels on.

A function is one kernel, for one set of argument types.
"""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import CellType, FunctionType
from typing import Any, NamedTuple

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record

from . import language as lang
from .language import ArrayOf, Known, Pointer, RefusedError, Value
from .statements import INDENT, MARK, Statements

MOST_PASSES = 5
"""Passes over a function until the types of its names have settled; two are usual."""
FIELD, CALL, CONSTANT = map(re.compile, (r"«(\d+):(\w+)»", r"¤(\d+)\(", r"¶(\d+);"))
"""Markers of fields, calls and constants, whose names are decided at the end."""


@dataclass(frozen=True)
class Parameter:
    """An argument in C."""

    name: str
    type: lang.Type
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
    result: lang.Type
    lines: tuple[str, ...]
    stores: frozenset[lang.FieldName]
    """Fields of records that it writes."""

    @property
    def head(self) -> list[tuple[str, bool]]:
        """Names of its parameters, and which are written."""
        return [(parameter.name, parameter.is_written) for parameter in self.parameters]


@cache
def parse_body(body: Callable[..., Any]) -> tuple[ast.FunctionDef, str]:
    """Return the syntax tree of a function, and its file from the package's folder on."""
    tree = ast.parse(textwrap.dedent(inspect.getsource(body))).body[0]
    path = Path(inspect.getsourcefile(body) or "?")
    packages = [k for k, part in enumerate(path.parts) if part.startswith("space_robot_")]
    file = "/".join(path.parts[packages[-1] :]) if packages else str(path)
    if not isinstance(tree, ast.FunctionDef):
        line = body.__code__.co_firstlineno
        raise lang.NotInSubsetError(file, line, "a lambda", "write a kernel with def")
    return tree, file


def translated(
    program: Any, body: Callable[..., Any], kinds: tuple[lang.Type, ...], label: str
) -> Function:
    """Translate a kernel of a program for types of arguments; ``label`` is a bundle's."""
    types: dict[str, lang.Type] = {}
    result: lang.Type = None
    for _ in range(MOST_PASSES):  # an integer may turn out to be a float at the end of a loop
        translation = Statements(program, body, *parse_body(body), kinds)
        translation.types |= types
        translation.result = result
        translation.body()
        if translation.types == types and translation.result == result:
            break
        types, result = dict(translation.types), translation.result
    written = set(translation.written)
    for value in translation.names.values():
        kind = value.type
        if isinstance(kind, ArrayOf) and len(kind.shape) > 1 and not kind.is_table:
            written |= value.roots  # C99 cannot pass variable rows as constant ones
    declarations = {
        name: program.declaration(kind, name, name in written)
        for name, kind in translation.types.items()
        if name not in translation.own and not isinstance(kind, Known)
    }
    lines = declared(translation.lines, declarations)
    text = "\n".join(lines)
    is_used = {p: bool(re.search(rf"\b{p}\b", text)) for p, _ in translation.parameters}
    kept = [(p, kind) for p, kind in translation.parameters if is_used[p] or p in translation.own]
    ignored = [f"    (void){p};" for p, _ in kept if not is_used[p]]
    return Function(
        body,
        label,
        tuple(Parameter(p, kind, p in written) for p, kind in kept),
        tuple(tuple(p for p in names if p in dict(kept)) for names in translation.arguments),
        translation.result or lang.VOID,
        tuple(ignored + lines),
        frozenset(translation.stores),
    )


def declared(lines: Sequence[str], declarations: Mapping[str, str]) -> list[str]:
    """Return lines in which each name is declared in the innermost block that has it.

    Args:
        lines: of a function, indented, with a `MARK` around a name that gets a value.
        declarations: of each local name.
    """
    done = list(lines)
    for name, declaration in declarations.items():
        value = f"{MARK}{name}{MARK} = "
        mention = re.compile(rf"(?<![\w.>:]){name}\b")
        places = [k for k, line in enumerate(done) if mention.search(line)]
        for place in reversed(places):  # what nobody reads
            _, is_value, source = done[place].partition(value)
            if len(places) == 1 and is_value and "(" not in source:  # a call may write
                del done[place]
                places = []
        if not places:
            continue
        first, level = places[0], _level(done[places[0]])
        while not _is_in_block(done, first, level, places[-1]):
            level -= 1
            first = _beginning(done, first, level)
        is_in_loop = any(_is_loop_around(done, k, first) for k in range(first))
        if first == places[0] and done[first].strip().startswith(value):
            done[first] = done[first].replace(value, f"{declaration} = ")
        else:
            # in a loop it keeps its value from one turn to the next, as in Python
            place, level = (0, 1) if is_in_loop else (first, level)
            done.insert(place, f"{INDENT * level}{declaration};")
    return [line.replace(MARK, "") for line in done]


def _level(line: str) -> int:
    return (len(line) - len(line.lstrip())) // len(INDENT)


def _is_in_block(lines: Sequence[str], first: int, level: int, last: int) -> bool:
    return all(_level(line) >= level for line in lines[first : last + 1])


def _beginning(lines: Sequence[str], place: int, level: int) -> int:
    while _level(lines[place]) > level or lines[place].strip().startswith("}"):
        place -= 1
    return place


def _is_loop_around(lines: Sequence[str], head: int, place: int) -> bool:
    level, is_loop = _level(lines[head]), lines[head].strip().startswith(("for (", "while ("))
    return is_loop and all(_level(line) > level for line in lines[head + 1 : place + 1])


def passed(function: Function, arguments: tuple[Value, ...]) -> list[Value]:
    """Return the value of each parameter in a call."""
    values: list[Value] = []
    for names, argument in zip(function.arguments, arguments, strict=True):
        if isinstance(argument.type, lang.Bundle):
            items = zip(argument.type.items, argument.parts, strict=True)
            by_name = {f"_{item}": part for (item, _), part in items}
            values += [next(v for end, v in by_name.items() if n.endswith(end)) for n in names]
        elif names:
            values.append(argument)
    return values


class Constant(NamedTuple):
    """A named number."""

    name: str
    number: Any
    """Or a table of numbers, a tuple of tuples."""


class KernelProgram:
    """Translation of kernels and of all that they call.

    Functions are translated for the types of their arguments. Numbers that never change are known:
    a branch that they decide is left out, and so is what only that branch needs.
    """

    def __init__(
        self,
        sizes: Mapping[str, int],
        joints: int,
        target: lang.C99 | None = None,
        instead: Mapping[Any, Any] | None = None,
    ) -> None:
        """Begin, for n joints, of which the shapes of records are functions.

        ``sizes`` stand for constants of modules by name, as capacities of arrays; ``target`` is the
        language that is written, C99 if none is given; ``instead`` has the kernels that stand for
        others, those that compute in lanes.
        """
        self.sizes, self.joints, self.target = dict(sizes), joints, target or lang.C99()
        self.instead = {key.py_func: value.py_func for key, value in (instead or {}).items()}
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
        numbers: tuple[int, ...] = tuple(self._resized(declared.shape)(self.joints))
        return numbers

    def _resized(self, shape: Any) -> Any:
        """Return a function that reads the export's capacities in place of its module's."""
        cells = [cell.cell_contents for cell in shape.__closure__ or ()]
        inner = (self._resized(c) if isinstance(c, FunctionType) else c for c in cells)
        closure = tuple(map(CellType, inner)) or None
        sizes = {**shape.__globals__, **self.sizes}
        return FunctionType(shape.__code__, sizes, None, None, closure)

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

    def type_name(self, kind: lang.Type) -> str:
        """Return the name of a scalar's or tuple's type."""
        name: str = self.tuple_name(kind) if isinstance(kind, lang.TupleOf) else kind.name
        return name

    def declaration(self, kind: lang.Type, name: str, is_written: bool = True) -> str:
        """Return the declaration of a local name; a pointer is to constants if not written."""
        const = "" if is_written else "const "
        if isinstance(kind, (Pointer, lang.BlockOf)):
            return f"{const}{self.struct_name(kind.record)} *{name}"
        if isinstance(kind, ArrayOf) and kind.is_local:
            return f"{kind.item.name} {name}[{kind.shape[0]}]"
        if isinstance(kind, ArrayOf) and len(kind.shape) == 1:
            return f"{const}double *{name}"
        if isinstance(kind, ArrayOf):
            sizes = "".join(f"[{size}]" for size in kind.shape[1:])
            return f"{const}double (*{name}){sizes}"
        return f"{self.type_name(kind)} {name}"

    def parameter(self, parameter: Parameter) -> str:
        """Return the declaration of a parameter, with the sizes of an array."""
        kind = parameter.type
        if not isinstance(kind, ArrayOf):
            return self.declaration(kind, parameter.name, parameter.is_written)
        first, *rest = (size or "" for size in kind.shape)
        # C99 cannot pass variable rows as constant ones
        is_constant = not parameter.is_written and (not rest or kind.is_table)
        const = "const " if is_constant else ""
        sizes = "".join(f"[{size}]" for size in rest)
        return f"{const}double {parameter.name}[{first}]{sizes}"

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
        body = self.instead.get(body, body)
        tree, file = parse_body(body)
        if len(tree.args.args) != len(arguments):
            raise RefusedError(f"a call of {tree.name}() without all arguments", "give them all")
        # a truth value that is known is bound
        kinds = tuple(
            Known(a.constant)
            if a.is_bound or (a.type == lang.BOOL and a.constant is not None)
            else a.type
            for a in arguments
        )
        if (body, kinds) in self._known:
            return self._known[body, kinds]
        if body in self._active:  # a flight computer's stack is bounded
            line = body.__code__.co_firstlineno
            raise lang.NotInSubsetError(file, line, "recursion", "write a loop")
        labels = [kind.label for kind in kinds if isinstance(kind, lang.Bundle)]
        self._active.append(body)
        new = translated(self, body, kinds, labels[0] if labels else "")
        self._active.pop()
        number = len(self.functions)
        for k, old in enumerate(self.functions):
            # lengths that are not read make no other function
            if old.body is body and old.lines == new.lines and old.head == new.head:
                pairs = zip(old.parameters, new.parameters, strict=True)
                merged = tuple(replace(p, type=lang.joined(p.type, q.type)) for p, q in pairs)
                self.functions[k] = replace(old, parameters=merged)
                number = k
                break
        else:
            self.functions.append(new)
        self._known[body, kinds] = number
        return number
