"""The initial numbers of the state struct: tables with unit and source, and their assignment."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, NamedTuple

import numpy as np

from space_robot_msgs_py.compiled.records import Record

from .c99 import language as lang
from .c99.language import literal
from .files import comment, descriptions, wrapped
from .software import Part, Translated, numbers_of


class Entry(NamedTuple):
    """A number, or an array of numbers, of the state struct."""

    path: str
    """In the state struct."""
    definition: str
    """In ``parameters.h``."""
    assignment: str
    """In `space_robot_init`."""


def entries(translated: Translated) -> Iterator[Entry]:
    """Return all numbers that are not zero before the first tick."""
    for part in translated.software.parts:
        path = part.name
        source = f" Source: {part.source}." if part.source else ""
        yield from _entries(translated, part.record, part.numbers, path, source)


def reset_lines(translated: Translated, part: Part) -> list[str]:
    """Return the assignments that a law's memory needs after it has been cleared."""
    inner = _entries(translated, part.record, part.numbers, part.name, "")
    return [entry.assignment for entry in inner]


def _entries(
    translated: Translated, record: type[Record], numbers: Any, path: str, source: str
) -> Iterator[Entry]:
    said = descriptions(record)
    for name, kind in translated.kept(record):
        inside = f"{path}.{name}"
        if not isinstance(kind, tuple):
            yield from _entries(translated, kind, numbers[name], inside, source)
            continue
        kept = numbers_of(kind, numbers[name])
        is_table = lang.FieldName(record, name) in translated.tables
        if is_table or not np.any(kept.view(np.int64)):
            continue
        constant = f"SR_{inside.replace('.', '_').upper()}"
        about = comment(f"{inside}: {said.get(name, 'see its struct.')}{source}")
        if not kind:
            text = literal(float(kept))
            yield Entry(
                inside, f"{about}#define {constant} ({text})\n", f"state->{inside} = {constant};"
            )
            continue
        flat, target = kept.reshape(-1), f"state->{inside}"
        if np.all(flat == flat[0]) or np.all(np.isnan(flat)):
            define = f"#define {constant} ({literal(float(flat[0]))})\n"
            yield Entry(inside, about + define, _by_rows("fill", target, constant, kind))
            continue
        values = wrapped("    " + ", ".join(literal(float(value)) for value in flat))
        table = f"static const double {constant}[{flat.size}] = {{\n{values}\n}};\n"
        yield Entry(inside, about + table, _by_rows("copy", target, constant, kind))


def _by_rows(function: str, target: str, source: str, shape: tuple[int, ...]) -> str:
    """Return the call of ``copy`` or ``fill`` for an array, row by row of a matrix."""
    if len(shape) == 1:
        return f"{function}({target}, {source}, {shape[0]});"
    rows, columns = shape
    part = source if function == "fill" else f"&{source}[row * {columns}]"
    call = f"{function}({target}[row], {part}, {columns});"
    return f"for (int64_t row = 0; row < {rows}; ++row) {{\n        {call}\n    }}"
