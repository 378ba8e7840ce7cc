"""Opening and recovery of the journal of a campaign's folder."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import suppress
from itertools import chain
from pathlib import Path

from space_robot_msgs_py.errors import InputError

from ..row.row import Row
from .folder import JOURNAL, TABLE
from .journal import Journal
from .journal_codec import JournalCodec
from .journal_file import SET_ASIDE, damage_of, whole_rows, write_journal
from .manifest import Manifest
from .table import check_table, table_rows

MOST_NAMED = 3
"""Maximum number of damaged rows listed in a message."""


def open_journal(folder: Path, manifest: Manifest) -> tuple[Journal, list[str]]:
    """Open the journal of a folder; create or repair it if necessary.

    From a damaged journal all undamaged rows are kept; the others are taken from the table if it
    is undamaged, so that as few flights as possible are flown again.

    Args:
        folder: of a campaign, locked by this process.
        manifest: of the campaign.

    Returns:
        The journal, and a line for each damage.

    Raises:
        InputError: the journal cannot be opened or written.
    """
    path, codec = folder / JOURNAL, JournalCodec(manifest.campaign, manifest.laws)
    damaged = []
    if (folder / TABLE).exists():
        try:
            check_table(folder / TABLE, manifest.campaign)
        except InputError as error:
            damaged.append(str(error))
    if not path.exists():
        count = write_journal(path, codec, _rows_of_table(folder, manifest))
        if (folder / TABLE).exists():
            damaged.append(f"{path}: missing; {count} rows are taken from {TABLE}")
    elif damage := damage_of(path, codec):
        rows = chain(whole_rows(path, codec), _rows_of_table(folder, manifest))
        count = write_journal(path, codec, rows)
        more = f" and {len(damage) - MOST_NAMED} more" * (len(damage) > MOST_NAMED)
        damaged.append(
            f"{path}: damaged: {', '.join(damage[:MOST_NAMED])}{more}; {count} rows are kept, "
            f"and the damaged file is renamed to {JOURNAL}{SET_ASIDE}"
        )
    return Journal(path, codec), damaged


def _rows_of_table(folder: Path, manifest: Manifest) -> Iterator[Row]:
    """Yield the rows of an undamaged table; nothing if it is damaged or missing."""
    with suppress(InputError):
        check_table(folder / TABLE, manifest.campaign)
        yield from table_rows(folder / TABLE, manifest.table)
