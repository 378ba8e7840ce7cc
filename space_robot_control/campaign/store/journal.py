"""The journal: a row as it ends, in SQLite, so that a kill at any moment loses no row before it."""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import Self

from space_robot_msgs_py.errors import InputError

from ..row.row import Row, Task

_TABLES = """
CREATE TABLE IF NOT EXISTS rows (
    run INTEGER, law INTEGER, outcome TEXT, numbers TEXT, bands BLOB, PRIMARY KEY (run, law)
) WITHOUT ROWID;
CREATE TABLE IF NOT EXISTS notes (name TEXT PRIMARY KEY, value TEXT) WITHOUT ROWID;
"""


class Journal:
    """The rows of a campaign that have been flown; a context."""

    def __init__(self, path: Path, laws: list[str]) -> None:
        """Open or make it.

        Args:
            path: of the file.
            laws: of the campaign, in their order.

        Raises:
            InputError: it cannot be opened, or is no journal.
        """
        self._path, self._laws = path, laws
        self._number = {law: number for number, law in enumerate(laws)}
        with self._told():
            # manual transactions: a statement is one of its own
            self._database = sqlite3.connect(path, isolation_level=None)
            # exclusive: the log ahead then needs no shared memory, which network drives lack
            self._database.execute("PRAGMA locking_mode = EXCLUSIVE")
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = NORMAL")
            self._database.executescript(_TABLES)

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._database.close()

    def add(self, row: Row) -> None:
        """Keep a row, in the place of an older one of its task.

        Raises:
            InputError: it cannot be written; all rows before it are kept.
        """
        task = row.task.run, self._number[row.task.law]
        with self._told():
            self._database.execute(
                "INSERT OR REPLACE INTO rows VALUES (?, ?, ?, ?, ?)",
                (*task, row.outcome, _numbers(row), _bands(row)),
            )

    def rows(self, runs: int) -> Iterator[Row]:
        """Yield the rows of the runs before ``runs`` in the order of the table: run, then law."""
        with self._told():
            found = self._database.execute(
                "SELECT run, law, outcome, numbers, bands FROM rows WHERE run < ?"
                " ORDER BY run, law",
                (runs,),
            )
            for run, law, outcome, numbers, bands in found:
                yield _row(Task(run, self._laws[law]), outcome, numbers, bands)

    def note(self, name: str) -> str:
        """Return a note; empty if there is none of that name."""
        with self._told():
            query = "SELECT value FROM notes WHERE name = ?"
            found = self._database.execute(query, (name,)).fetchone()
        return found[0] if found else ""

    def make_note(self, name: str, value: str) -> None:
        """Keep a note, in the place of an older one of that name."""
        with self._told():
            self._database.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    @contextmanager
    def _told(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise InputError(f"{self._path}: {error}; the rows kept so far are safe") from None


def _numbers(row: Row) -> str:
    """Write all but the bands' numbers; Python's JSON has every digit of a number."""
    return json.dumps({
        "reason": row.reason, "ended_at_s": row.ended_at_s, "vary": dict(row.vary),
        "metrics": dict(row.metrics), "require": dict(row.require), "digest": row.digest,
        "bands": {name: len(band) for name, band in row.bands.items()},
    })  # fmt: skip


def _bands(row: Row) -> bytes:
    return b"".join(band.astype("<f4").tobytes() for band in row.bands.values())


def _row(task: Task, outcome: str, numbers: str, bands: bytes) -> Row:
    content: dict[str, Any] = json.loads(numbers)
    lengths: dict[str, int] = content.pop("bands")
    values = np.frombuffer(bands, "<f4")
    parts = np.split(values, np.cumsum(list(lengths.values()))[:-1]) if lengths else []
    return Row(task, outcome, bands=dict(zip(lengths, parts, strict=True)), **content)
