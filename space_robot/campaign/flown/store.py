"""The folder of a campaign: its rows and manifest in SQLite, locked by one writer at a time."""

from __future__ import annotations

import fcntl
import json
import os
import sqlite3
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
from typing_extensions import Self

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ...console.files import atomic_file, make_folder
from ...scenario.recorded import differences
from ..row.row import Row, Task
from ..study import read_study
from .manifest import NEW_FOLDER, Manifest

DATABASE, STUDY, BAGS, LOCK = "campaign.sqlite", "study.yaml", "bags", ".lock"
_TABLES = (
    "CREATE TABLE IF NOT EXISTS meta (key TEXT PRIMARY KEY, value TEXT)",
    "CREATE TABLE IF NOT EXISTS flights (run INTEGER, law TEXT, outcome TEXT, reason TEXT, "
    "ended_at_s REAL, vary TEXT, metrics TEXT, require TEXT, band_lengths TEXT, bands BLOB, "
    "warnings TEXT, digest TEXT, PRIMARY KEY (run, law))",
)
TRANSIENT_ERRORS = (
    "database is locked",
    "unable to open database file",
    "database or disk is full",
    "attempt to write a readonly database",
    "disk I/O error",
)
"""Errors of SQLite that do not indicate a damaged file."""


class CampaignStore:
    """The database of a campaign's folder; a context manager."""

    def __init__(self, path: Path, is_read_only: bool = True) -> None:
        """Open a database and check that it is undamaged; one to be written is created."""
        self.path, self._is_read_only = path, is_read_only
        with self._named_errors():
            uri = f"{path.absolute().as_uri()}?mode={'ro' if is_read_only else 'rwc'}"
            self._database = sqlite3.connect(uri, uri=True, isolation_level=None)
            if not is_read_only:
                self._database.execute("PRAGMA journal_mode = WAL")
                self._database.execute("PRAGMA synchronous = NORMAL")
                for table in _TABLES:
                    self._database.execute(table)
            (problem,) = self._database.execute("PRAGMA integrity_check(1)").fetchone()
            if problem != "ok":
                raise sqlite3.DatabaseError(" ".join(str(problem).split()))

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *exception: object) -> None:
        if not self._is_read_only:
            with suppress(sqlite3.Error):  # one plain file, unless somebody is reading it
                self._database.execute("PRAGMA journal_mode = DELETE")
        self._database.close()

    @property
    def manifest(self) -> Manifest | None:
        """The stored manifest; None before the campaign has begun."""
        with self._named_errors():
            query = "SELECT value FROM meta WHERE key = 'manifest'"
            stored = self._database.execute(query).fetchone()
            try:
                return stored and Manifest.model_validate_json(stored[0])
            except ValueError as error:
                raise sqlite3.DatabaseError(f"manifest: {str(error).splitlines()[0]}") from None

    def write_manifest(self, manifest: Manifest) -> None:
        """Store the manifest; it replaces an older one."""
        with self._named_errors():
            query = "INSERT OR REPLACE INTO meta VALUES ('manifest', ?)"
            self._database.execute(query, (manifest.model_dump_json(),))

    def add(self, row: Row) -> None:
        """Store a row; it replaces an older one of the same task."""
        mappings = row.vary, row.metrics, row.require, {n: len(b) for n, b in row.bands.items()}
        values = (
            *row.task,
            row.outcome,
            row.reason,
            row.ended_at_s,
            *(json.dumps(dict(mapping)) for mapping in mappings),
            b"".join(band.astype("<f4").tobytes() for band in row.bands.values()),
            row.warnings,
            row.digest,
        )
        with self._named_errors():
            query = f"INSERT OR REPLACE INTO flights VALUES ({', '.join('?' * len(values))})"
            self._database.execute(query, values)

    def rows(self) -> Iterator[Row]:
        """Yield all rows, ordered by run."""
        with self._named_errors():
            for values in self._database.execute("SELECT * FROM flights ORDER BY run"):
                run, law, outcome, reason, ended_at_s, *texts, bands, warnings, digest = values
                try:
                    vary, metrics, require, lengths = map(json.loads, texts)
                    ends = np.cumsum(list(lengths.values()))
                    parts = np.split(np.frombuffer(bands, "<f4"), ends[:-1]) if lengths else []
                    by_name = dict(zip(lengths, parts, strict=True))
                except (ValueError, TypeError) as error:
                    raise sqlite3.DatabaseError(f"run {run} under {law}: {error}") from None
                rest = vary, metrics, require, by_name, warnings, digest
                yield Row(Task(run, law), outcome, reason, ended_at_s, *rest)

    @contextmanager
    def _named_errors(self) -> Iterator[None]:
        try:
            yield
        except sqlite3.Error as error:
            if str(error).startswith(TRANSIENT_ERRORS):
                text = f"{error}; the same command flies the missing flights"
            else:
                text = f"damaged: {error}; fly the campaign into another folder"
            raise InputError(f"{self.path}: {text}") from None


def open_store(folder: Path) -> CampaignStore:
    """Open the store of a campaign's folder for reading."""
    if not (folder / DATABASE).is_file():
        raise InputError(f"{folder}: not a campaign folder (it has no {DATABASE})")
    return CampaignStore(folder / DATABASE)


@contextmanager
def held_store(folder: Path) -> Iterator[CampaignStore]:
    """Open the store of a folder for writing, locked for this process; create what is missing."""
    make_folder(folder)
    _check_own(folder)
    try:
        descriptor = os.open(folder / LOCK, os.O_RDWR | os.O_CREAT | os.O_CLOEXEC, 0o644)
    except OSError as error:
        raise InputError(f"{folder}: cannot be written ({error.strerror})") from None
    try:
        try:
            fcntl.lockf(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except OSError:
            raise InputError(f"{folder}: another process is flying this campaign") from None
        with CampaignStore(folder / DATABASE, is_read_only=False) as store:
            yield store
    finally:
        os.close(descriptor)


def begin_or_resume(store: CampaignStore, manifest: Manifest, study_text: str) -> str:
    """Write study and manifest of a new campaign, or check that an existing one is the same.

    Returns a line if the folder's copy of the study was changed, else nothing.
    """
    study, changes = store.path.parent / STUDY, ""
    if before := store.manifest:
        before.check_same(manifest, store.path.parent)
        changes = study_changes(study, manifest.study) if study.exists() else ""
    if before is None or not study.exists():
        with atomic_file(study, replace=True) as file:
            file.write(study_text.encode())
    store.write_manifest(manifest)
    return changes


def study_changes(file: Path, flown: Mapping[str, Any]) -> str:
    """Return how a folder's copy of the study differs from the flown content, or nothing."""
    try:
        now = read_study(file.absolute()).content
    except InputError as error:
        return f"{error}; {DATABASE} has the study that was flown"
    for key, old, new in differences(flown, now):
        what = f"{short(old)} was flown, {short(new)} is in the file now"
        return f"{file}: was changed after the campaign was started: {key}: {what}"
    return ""


def _check_own(folder: Path) -> None:
    own = DATABASE, STUDY, BAGS, LOCK
    for path in folder.iterdir():
        is_own = path.name.lstrip(".").startswith(tuple(name.lstrip(".") for name in own))
        if not is_own and not (folder / DATABASE).exists():
            raise InputError(
                f"{folder}: contains {path.name} and no {DATABASE}, so it is not a campaign "
                f"folder: {NEW_FOLDER}"
            )
        if is_own and not (path.is_file() or path.is_dir()):
            raise InputError(f"{path}: not a file")  # a pipe would be read for ever
