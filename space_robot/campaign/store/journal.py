"""Journal of a campaign in SQLite: each row is stored at once, so that a kill loses no rows."""

from __future__ import annotations

import sqlite3
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from typing_extensions import Self

from space_robot_msgs_py.errors import InputError

from ..row.row import Row
from .journal_codec import JournalCodec
from .journal_file import IN_ORDER, INSERT, SELECT, connect


class Journal:
    """The flown rows of a campaign; a context manager."""

    def __init__(self, path: Path, codec: JournalCodec) -> None:
        """Open an existing, undamaged journal; see `open_journal`.

        Args:
            path: of the file.
            codec: of the campaign.

        Raises:
            InputError: it cannot be opened.
        """
        self._path, self._codec = path, codec
        with self._named_errors():
            self._database = connect(path)
            self._database.execute("PRAGMA journal_mode = WAL")
            self._database.execute("PRAGMA synchronous = NORMAL")

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        self._database.close()

    def add(self, row: Row) -> None:
        """Store a row; it replaces an older one of the same task.

        Raises:
            InputError: the journal cannot be written.
        """
        with self._named_errors():
            self._database.execute(f"INSERT OR REPLACE {INSERT}", self._codec.encode(row))

    def rows(self, runs: int) -> Iterator[Row]:
        """Yield the rows of the first ``runs`` runs in the order of the table: run, then law.

        Raises:
            InputError: the journal cannot be read, or a row was damaged after it was opened.
        """
        with self._named_errors():
            query = f"{SELECT} WHERE run < ? {IN_ORDER}"
            for stored in self._database.execute(query, (runs,)):
                if (row := self._codec.decode(stored)) is None:
                    raise InputError(f"{self._path}: was modified while it was open")
                yield row

    def note(self, name: str) -> str:
        """Return a note by name; empty if it does not exist."""
        with self._named_errors():
            query = "SELECT value FROM notes WHERE name = ?"
            record = self._database.execute(query, (name,)).fetchone()
        return str(record[0]) if record else ""

    def make_note(self, name: str, value: str) -> None:
        """Store a note; it replaces an older one of the same name."""
        with self._named_errors():
            self._database.execute("INSERT OR REPLACE INTO notes VALUES (?, ?)", (name, value))

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            raise InputError(
                f"{self._path}: {error}; the same command flies the missing flights"
            ) from None
