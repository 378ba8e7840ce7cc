"""Updates of a campaign's table from its journal, where it is missing, damaged or outdated."""

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
"""Note of the journal: number of runs and digest of the table; empty during the flights."""


def write_if_older(folder: Path, journal: Journal, manifest: Manifest, runs: int) -> None:
    """Write the table of the first ``runs`` runs unless it exists undamaged."""
    path = folder / TABLE
    with suppress(InputError):
        check_table(path, manifest.campaign)
        if journal.note(WRITTEN) == f"{runs} {file_digest(path)}":
            return
    digest = write_table(path, manifest.table, manifest.campaign, journal.rows(runs))
    journal.make_note(WRITTEN, f"{runs} {digest}")


def recover_table(folder: Path, manifest: Manifest, study: Study) -> list[str]:
    """Write the table of a killed campaign from the rows of its journal.

    Returns:
        A line for each damaged file.

    Raises:
        InputError: another process is flying it, or the folder cannot be written.
    """
    with held_folder(folder):
        journal, damage = open_journal(folder, manifest)
        with journal:
            precision = Precision(study, manifest.runs, manifest.table.grid)
            for row in journal.rows(manifest.runs):
                precision.add(row)
            write_if_older(folder, journal, manifest, precision.stop)
    return damage
