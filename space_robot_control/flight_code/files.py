"""The text of a translated program: structs, constants, prototypes, and functions by room."""

from __future__ import annotations

import ast
import inspect
import re
import textwrap
from collections import defaultdict
from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np

from space_robot_msgs_py.compiled.records import Field as RecordField
from space_robot_msgs_py.compiled.records import Record

from .c99 import language as lang
from .c99.program import CALL, CONSTANT, FIELD, Constant, Function, KernelProgram, parse_body

WIDTH = 100
"""Longest line."""


def comment(text: str, indent: str = "") -> str:
    """Return a comment, wrapped."""
    lines = inspect.cleandoc(re.sub(r"`+", "", text).replace("*/", "* /")).splitlines()
    if len(lines) == 1 and len(indent) + len(lines[0]) + 6 <= WIDTH:
        return f"{indent}/* {lines[0]} */\n"
    body = "".join(f"{indent} * {line}".rstrip() + "\n" for line in lines)
    return f"{indent}/*\n{body}{indent} */\n"


def wrapped(line: str) -> str:
    """Return a line of code, broken between words where it is too long."""
    if len(line) <= WIDTH:
        return line
    indent = line[: len(line) - len(line.lstrip())]
    # a type stays with its name
    bound = re.sub(r"(const|static|return|\w+_\w+|double) (?=[*\w])", "\\1\0", line.strip())
    parts = textwrap.wrap(
        bound,
        WIDTH - len(indent),
        subsequent_indent="    ",
        break_long_words=False,
        break_on_hyphens=False,
    )
    return "\n".join(f"{indent}{part}" for part in parts).replace("\0", " ")


def descriptions(record: type[Record]) -> dict[str, str]:
    """Return the texts on the fields of a record, from its class and those above."""
    texts: dict[str, str] = {}
    for owner in reversed(record.__mro__):
        if not issubclass(owner, Record) or owner is Record:
            continue
        # Python keeps no text that stands below an attribute, but its source has it
        tree: Any = ast.parse(textwrap.dedent(inspect.getsource(owner))).body[0]
        for this, after in zip(tree.body, [*tree.body[1:], None], strict=True):
            is_said = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant)
            if isinstance(this, ast.AnnAssign) and isinstance(this.target, ast.Name) and is_said:
                texts[this.target.id] = str(after.value.value)
        for name, field in owner.fields().items():
            if isinstance(field, RecordField) and field.description:
                texts.setdefault(name, f"{field.description}.")
    return texts


def reachable(program: KernelProgram, first: Iterable[Function]) -> list[Function]:
    """Return the functions that are called from the ``first`` ones, callees first."""
    reached: list[Function] = []

    def visit(function: Function) -> None:
        if function in reached:
            return
        for number in CALL.findall("\n".join(function.lines)):
            visit(program.functions[int(number)])
        reached.append(function)

    for function in first:
        visit(function)
    return reached


class Files:
    """Writer of a program's files."""

    def __init__(
        self,
        program: KernelProgram,
        first: Sequence[Function],
        whole: Iterable[type[Record]],
        room_of: Callable[[str], str],
    ) -> None:
        """Take the functions that are reached from the ``first`` ones.

        Args:
            program: that they are part of.
            first: called from outside.
            whole: records whose fields are all kept; others have those that are used.
            room_of: returns the file, without its ending, of a Python module's functions.
        """
        self.program, self.room_of = program, room_of
        self.functions = reachable(program, first)
        self._roots = {program.functions.index(function) for function in first}
        self._calling_rooms: defaultdict[int, set[str]] = defaultdict(set)
        """Files that call each function, by its number."""
        for function in self.functions:
            for number in CALL.findall("\n".join(function.lines)):
                self._calling_rooms[int(number)].add(room_of(function.body.__module__))
        self._text = "\n".join("\n".join(function.lines) for function in self.functions)
        self.fields = {
            lang.FieldName(program.records[int(number)], name)
            for number, name in FIELD.findall(self._text)
        }
        self.used = frozenset(self.fields)
        """Fields that functions read or write."""
        for record in whole:
            self.fields |= {lang.FieldName(record, name) for name in record.fields()}
        for record, name in list(self.fields):
            declared = record.fields()[name]
            if not isinstance(declared, RecordField) and not self.has(record, name):
                self.fields.add(self._some_field(declared))  # a struct is never empty
        self._names = self._function_names()
        self._constants = self._constant_names()

    def _some_field(self, record: type[Record]) -> lang.FieldName:
        for name, declared in record.fields().items():
            if not isinstance(declared, RecordField):
                return self._some_field(declared)
            if 0 not in self.program.shape(record, name):
                return lang.FieldName(record, name)
        raise AssertionError(record)

    def has(self, record: type[Record], name: str) -> bool:
        """Return whether a field is part of the exported struct."""
        declared = record.fields()[name]
        if not isinstance(declared, RecordField):
            return any(self.has(declared, inner) for inner in declared.fields())
        is_empty = 0 in self.program.shape(record, name)  # C has no such arrays
        return lang.FieldName(record, name) in self.fields and not is_empty

    def kept(self, record: type[Record]) -> Iterator[tuple[str, tuple[int, ...] | type[Record]]]:
        """Return the fields of an exported struct: shapes, or records."""
        for name, field in record.fields().items():
            if self.has(record, name):
                is_array = isinstance(field, RecordField)
                yield name, self.program.shape(record, name) if is_array else field  # type: ignore[misc]

    def dtype(self, record: type[Record]) -> np.dtype[Any]:
        """Return the memory layout of an exported struct."""
        return np.dtype(
            [
                (name, np.float64, kind) if isinstance(kind, tuple) else (name, self.dtype(kind))
                for name, kind in self.kept(record)
            ]
        )

    def name_of(self, function: Function) -> str:
        """Return a function's name in C."""
        return self._names[self.program.functions.index(function)]

    def final(self, text: str) -> str:
        """Return a text with its final names."""
        text = FIELD.sub(lambda m: m[2], text)
        text = CALL.sub(lambda m: f"{self._names[int(m[1])]}(", text)
        return CONSTANT.sub(lambda m: self._constants[int(m[1])], text)

    def _named_numbers(self) -> list[Constant]:
        numbers = {int(number) for number in CONSTANT.findall(self._text)}
        return [c for c, number in self.program.named_numbers.items() if number in numbers]

    def struct(self, record: type[Record]) -> str:
        """Return the definition of a record's struct, without those of its nested records."""
        texts = descriptions(record)
        text = comment(inspect.getdoc(record) or record.__name__)
        text += "typedef struct {\n"
        for name, field in record.fields().items():
            if not self.has(record, name):
                continue
            text += comment(texts[name], "    ") if name in texts else ""
            if isinstance(field, RecordField):
                sizes = "".join(f"[{size}]" for size in self.program.shape(record, name))
                text += f"    double {name}{sizes};\n"
            else:
                text += f"    {self.program.struct_name(field)} {name};\n"
        return f"{text}}} {self.program.struct_name(record)};\n"

    def structs(self, roots: Iterable[type[Record]]) -> str:
        """Return the definitions of records and of all nested in them."""
        done: list[type[Record]] = []

        def visit(record: type[Record]) -> None:
            for name, field in record.fields().items():
                if not isinstance(field, RecordField) and self.has(record, name):
                    visit(field)
            if record not in done:
                done.append(record)

        for root in roots:
            visit(root)
        return "\n".join(self.struct(record) for record in done)

    def tuples(self) -> str:
        """Return the definitions of the structs that stand for tuples."""
        used = "\n".join(self.prototype(f) + "\n".join(f.lines) for f in self.functions)
        text = ""
        for kind, name in self.program.tuples.items():
            if not re.search(rf"\b{name}\b", used):
                continue
            text += "typedef struct {\n"
            if kind.is_uniform:
                text += f"    double at[{len(kind.items)}];\n"
            else:
                for k, item in enumerate(kind.items):
                    text += f"    {self.program.type_name(item)} item_{k};\n"
            text += f"}} {name};\n\n"
        return text

    def constants(self) -> str:
        """Return the definitions of the constants that are read."""
        lines = []
        for constant in sorted(self._named_numbers()):
            name = self._constants[self.program.named_numbers[constant]]
            number = constant.number
            if isinstance(number, tuple):
                rows = ",\n    ".join(f"{{{', '.join(map(lang.literal, row))}}}" for row in number)
                size = f"[{len(number)}][{len(number[0])}]"
                lines.append(f"{self.program.target.table} {name}{size} = {{\n    {rows}}};\n")
                continue
            is_plain = isinstance(number, (float, np.uint64))
            value = lang.literal(number) if is_plain else f"INT64_C({number})"
            value = f"({value})" if value.startswith("-") else value
            lines.append(f"#define {name} {value}\n")
        return "".join(lines)

    def prototype(self, function: Function) -> str:
        """Return a function's head."""
        parameters = ", ".join(map(self.program.parameter, function.parameters))
        result = self.program.type_name(function.result)
        return f"{result} {self.name_of(function)}({parameters or 'void'})"

    def prototypes(self) -> str:
        """Return the declarations of the functions that several files call."""
        shared = [f for f in self.functions if not self._is_local(f)]
        before = self.program.target.shared_function
        return "".join(f"{wrapped(before + self.prototype(f))};\n" for f in shared)

    def rooms(self) -> dict[str, str]:
        """Return the functions by file."""
        texts: dict[str, str] = {}
        for function in self.functions:
            room = self.room_of(function.body.__module__)
            texts[room] = texts.get(room, "") + "\n" + self._definition(function)
        return texts

    def _definition(self, function: Function) -> str:
        tree, file = parse_body(function.body)
        about = ast.get_docstring(tree) or tree.name
        line = function.body.__code__.co_firstlineno
        text = comment(f"{about}\n\nPython: {tree.name}, {file}, line {line}.")
        target = self.program.target
        before = target.local_function if self._is_local(function) else target.shared_function
        text += wrapped(f"{before}{self.prototype(function)}")
        lines = (wrapped(self.final(line)) for line in function.lines)
        return "\n".join([text, "{", *lines, "}", ""])

    def _is_local(self, function: Function) -> bool:
        number = self.program.functions.index(function)
        home = self.room_of(function.body.__module__)
        return number not in self._roots and self._calling_rooms[number] == {home}

    def _function_names(self) -> dict[int, str]:
        names: dict[int, str] = {}
        for function in self.functions:
            name = function.body.__name__.lstrip("_")
            alike = [f for f in self.functions if f.body.__name__.lstrip("_") == name]
            if len({f.body for f in alike}) > 1:
                name = f"{function.body.__module__.rpartition('.')[2]}_{name}"
            if function.label and sum(f.body is function.body for f in alike) > 1:
                name = f"{name}_{function.label}"
            fresh, count = f"{lang.PREFIX}{name}", 1
            while fresh in names.values():
                count += 1
                fresh = f"{lang.PREFIX}{name}_{count}"
            names[self.program.functions.index(function)] = fresh
        return names

    def _constant_names(self) -> dict[int, str]:
        constants = self._named_numbers()
        names = {}
        for constant in constants:
            name = constant.name
            if sum(other.name == name for other in constants) > 1:
                name = f"{self.program.modules[constant].rpartition('.')[2].upper()}_{name}"
            names[self.program.named_numbers[constant]] = f"{lang.PREFIX.upper()}{name}"
        return names
