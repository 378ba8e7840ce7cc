"""The table of a folder's journal, written where it is missing, damaged or older than the rows."""

from __future__ import annotations

from contextlib import suppress
from pathlib import Path

from space_robot_msgs_py.errors import InputError

from ..store.folder import TABLE, held_folder
from ..store.journal import Journal
from ..store.manifest import Manifest
from ..store.recovery import open_journal
from ..store.table import check_table, file_digest, write_table
from ..study import Study
from .precision import Precision

WRITTEN = "table"
"""Note of the journal: the runs in the table and the digest of its bytes; none while it flies."""


def write_if_older(folder: Path, journal: Journal, manifest: Manifest, runs: int) -> None:
    """Write the table of the first ``runs`` runs, unless it is there, undamaged."""
    path = folder / TABLE
    with suppress(InputError):
        check_table(path, manifest.campaign)
        if journal.note(WRITTEN) == f"{runs} {file_digest(path)}":
            return
    digest = write_table(path, manifest.table, manifest.campaign, journal.rows(runs))
    journal.make_note(WRITTEN, f"{runs} {digest}")


def recover_table(folder: Path, manifest: Manifest, study: Study) -> list[str]:
    """Write the table of a campaign that was killed, of the rows that its journal has.

    Returns:
        What was damaged, a line each.

    Raises:
        InputError: another process flies it now, or nothing can be written there.
    """
    with held_folder(folder):
        journal, damage = open_journal(folder, manifest)
        with journal:
            precision = Precision(study, manifest.runs, manifest.table.grid)
            for row in journal.rows(manifest.runs):
                precision.add(row)
            write_if_older(folder, journal, manifest, precision.stop)
    return damage
