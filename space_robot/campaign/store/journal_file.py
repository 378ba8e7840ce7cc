"""The file of a journal: made whole, checked for damage, and its undamaged rows read."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from pathlib import Path
from secrets import token_hex

from space_robot_msgs_py.errors import InputError

from ..row.row import Row
from .journal_codec import JournalCodec

_NOTES = "CREATE TABLE notes (name TEXT PRIMARY KEY, value TEXT) WITHOUT ROWID"
_ROWS = (
    "CREATE TABLE rows (run INTEGER, law INTEGER, outcome TEXT, numbers TEXT, bands BLOB, "
    "digest TEXT, PRIMARY KEY (run, law)) WITHOUT ROWID"
)
SELECT = "SELECT run, law, outcome, numbers, bands, digest FROM rows"
IN_ORDER, BACKWARDS = "ORDER BY run, law", "ORDER BY run DESC, law DESC"
INSERT = "INTO rows VALUES (?, ?, ?, ?, ?, ?)"
SET_ASIDE = ".damaged"
"""What the name of a damaged journal ends with when another one has taken its place."""
NOT_OF_THE_FILE = (
    "database is locked",
    "unable to open database file",
    "database or disk is full",
    "attempt to write a readonly database",
    "out of memory",
)
"""Errors of SQLite that say nothing about the bytes of the file."""


def connect(path: Path) -> sqlite3.Connection:
    """Open a database for this process alone, in which every statement is a transaction."""
    database = sqlite3.connect(path, isolation_level=None)
    # exclusive: the log ahead then needs no shared memory, which network drives lack
    database.execute("PRAGMA locking_mode = EXCLUSIVE")
    # damaged text must come to its digest, which tells
    database.text_factory = lambda data: data.decode("utf-8", "replace")
    return database


def damage_of(path: Path, codec: JournalCodec) -> list[str]:
    """Return what is damaged in a journal: its rows, or what keeps it from being read.

    Raises:
        InputError: it cannot be opened, whatever is in it.
    """
    damaged, last = [], (-1, -1)
    try:
        with closing(connect(path)) as database:
            tables = [sql for (sql,) in database.execute("SELECT sql FROM sqlite_master")]
            if sorted(map(str, tables)) != [_NOTES, _ROWS]:
                return ["its tables are not those of a journal"]
            (problem,) = database.execute("PRAGMA quick_check(1)").fetchone()
            if problem != "ok":
                return [" ".join(str(problem).split())]
            for stored in database.execute(f"{SELECT} {IN_ORDER}"):
                run, law = stored[:2]
                if codec.decode(stored) is None or (run, law) <= last:
                    damaged.append(_named(run, law, codec))
                else:
                    last = run, law
    except sqlite3.Error as error:
        if str(error) in NOT_OF_THE_FILE:
            raise InputError(f"{path}: {error}") from None
        damaged.append(str(error))
    return damaged


def whole_rows(path: Path, codec: JournalCodec) -> Iterator[Row]:
    """Yield the undamaged rows that can be reached from either end of a journal, some twice."""
    for order in (IN_ORDER, BACKWARDS):
        with suppress(sqlite3.Error), closing(connect(path)) as database:
            for stored in database.execute(f"{SELECT} {order}"):
                if (row := codec.decode(stored)) is not None:
                    yield row


def write_journal(path: Path, codec: JournalCodec, rows: Iterable[Row]) -> int:
    """Write a journal, whole or not at all; one that is there is set aside.

    Args:
        path: of the file.
        codec: of the campaign.
        rows: to be in it; of several of a task the first is taken.

    Returns:
        The number of its rows.

    Raises:
        InputError: it cannot be written.
    """
    unfinished = path.with_name(f".{path.name}.{token_hex(4)}")
    try:
        with closing(connect(unfinished)) as database:
            database.execute(_NOTES)
            database.execute(_ROWS)
            database.execute("BEGIN")
            database.executemany(f"INSERT OR IGNORE {INSERT}", map(codec.encode, rows))
            database.execute("COMMIT")
            (count,) = database.execute("SELECT COUNT(*) FROM rows").fetchone()
        if path.exists():
            shutil.copyfile(path, path.with_name(path.name + SET_ASIDE))
        for of_the_old in ("-wal", "-shm", "-journal"):  # SQLite would take it for the new one's
            path.with_name(path.name + of_the_old).unlink(missing_ok=True)
        unfinished.replace(path)
    except (sqlite3.Error, OSError) as error:
        unfinished.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error})") from None
    return int(count)


def _named(run: object, law: object, codec: JournalCodec) -> str:
    """Name a row by what its damaged key says."""
    if isinstance(law, int) and 0 <= law < len(codec.laws):
        return f"run {run} under {codec.laws[law]}"
    return f"run {run} under a law that is not flown"
