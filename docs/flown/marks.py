"""The places of tables in pages: between ``<!-- table NAME -->`` and ``<!-- end -->``."""

from __future__ import annotations

import re
from collections.abc import Iterable, Sequence


def put(page: str, name: str, table: str) -> str:
    """Return the page with a table in its place.

    Raises:
        ValueError: it has no place for it, or more than one.
    """
    place = re.compile(rf"(<!-- table {re.escape(name)} -->\n\n).*?(\n\n<!-- end -->)", re.S)
    page, places = place.subn(lambda match: f"{match[1]}{table}{match[2]}", page)
    if places != 1:
        raise ValueError(f"{places} places for the table {name!r}")
    return page


def markdown(head: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table in Markdown."""
    lines = [f"| {' | '.join(row)} |".replace("|  |", "| |") for row in (head, *rows)]
    return "\n".join([lines[0], "|---" * len(head) + "|", *lines[1:]])
