"""The file of a journal: atomic creation, check for damage, recovery of undamaged rows."""

from __future__ import annotations

import shutil
import sqlite3
from collections.abc import Iterable, Iterator
from contextlib import closing, suppress
from pathlib import Path

from space_robot_msgs_py.errors import InputError

from ...console.files import unfinished_name
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
"""Suffix of a damaged journal that was replaced."""
NOT_OF_THE_FILE = (
    "database is locked",
    "unable to open database file",
    "database or disk is full",
    "attempt to write a readonly database",
    "out of memory",
)
"""Errors of SQLite that do not indicate a damaged file."""


def connect(path: Path) -> sqlite3.Connection:
    """Open a database exclusively; every statement is a transaction."""
    database = sqlite3.connect(path, isolation_level=None)
    # exclusive: the write-ahead log then needs no shared memory, which network drives lack
    database.execute("PRAGMA locking_mode = EXCLUSIVE")
    # damaged text must not raise an error here: the digest detects it
    database.text_factory = lambda data: data.decode("utf-8", "replace")
    return database


def damage_of(path: Path, codec: JournalCodec) -> list[str]:
    """Return the damage of a journal: names of rows, or why it cannot be read.

    Raises:
        InputError: it cannot be opened, for a reason other than damage.
    """
    damaged, last = [], (-1, -1)
    try:
        with closing(connect(path)) as database:
            tables = [sql for (sql,) in database.execute("SELECT sql FROM sqlite_master")]
            if sorted(map(str, tables)) != [_NOTES, _ROWS]:
                return ["not the tables of a journal"]
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
    """Yield the undamaged rows, reading a journal from both ends; some rows come twice."""
    for order in (IN_ORDER, BACKWARDS):
        with suppress(sqlite3.Error), closing(connect(path)) as database:
            for stored in database.execute(f"{SELECT} {order}"):
                if (row := codec.decode(stored)) is not None:
                    yield row


def write_journal(path: Path, codec: JournalCodec, rows: Iterable[Row]) -> int:
    """Write a journal atomically; an existing one is renamed.

    Args:
        path: of the file.
        codec: of the campaign.
        rows: to be written; the first one of each task.

    Returns:
        The number of its rows.

    Raises:
        InputError: the journal cannot be written.
    """
    unfinished = unfinished_name(path)
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
        for of_the_old in ("-wal", "-shm", "-journal"):  # SQLite would apply it to the new file
            path.with_name(path.name + of_the_old).unlink(missing_ok=True)
        unfinished.replace(path)
    except (sqlite3.Error, OSError) as error:
        unfinished.unlink(missing_ok=True)
        raise InputError(f"{path}: cannot be written ({error})") from None
    return int(count)


def _named(run: object, law: object, codec: JournalCodec) -> str:
    """Return the name of a row with a key that may be damaged."""
    if isinstance(law, int) and 0 <= law < len(codec.laws):
        return f"run {run} under {codec.laws[law]}"
    return f"run {run} under a law that is not flown"
