"""The table of a folder's journal, written where it is missing or older than the rows."""

from __future__ import annotations

from pathlib import Path

from ..store.folder import JOURNAL, MANIFEST, TABLE, held_folder
from ..store.journal import Journal
from ..store.manifest import read_manifest
from ..store.schema import Schema
from ..store.table import file_digest, write_table
from ..study import Study
from .precision import Precision

WRITTEN = "table"
"""Note of the journal: the runs in the table and the digest of its bytes; none while it flies."""


def write_if_older(folder: Path, journal: Journal, schema: Schema, runs: int) -> None:
    """Write the table of the first ``runs`` runs, unless it is there."""
    digest = file_digest(folder / TABLE)
    if not digest or journal.note(WRITTEN) != f"{runs} {digest}":
        digest = write_table(folder / TABLE, schema, journal.rows(runs))
        journal.make_note(WRITTEN, f"{runs} {digest}")


def recover_table(folder: Path, study: Study) -> None:
    """Write the table of a campaign that was killed, of the rows that its journal has.

    Raises:
        InputError: another process flies it now, or nothing can be written there.
    """
    manifest = read_manifest(folder / MANIFEST)
    with held_folder(folder), Journal(folder / JOURNAL, study.laws) as journal:
        precision = Precision(study, manifest.runs, manifest.table.grid)
        for row in journal.rows(manifest.runs):
            precision.add(row)
        write_if_older(folder, journal, manifest.table, precision.stop)
