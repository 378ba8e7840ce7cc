"""Tables in HTML, by which objects show themselves in notebooks."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from html import escape

MOST_LETTERS = 200
"""Of a cell."""


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return a table; cells that are numbers are aligned right, all others left.

    Args:
        heads: of the columns.
        rows: texts, one per column.
        caption: paragraph above the table; empty: none.
    """
    head = "".join(f"<th>{escape(text)}</th>" for text in heads)
    body = "".join(f"<tr>{''.join(map(_cell, row))}</tr>" for row in rows)
    above = f"<p>{escape(caption)}</p>" if caption else ""
    return f"{above}<table><tr>{head}</tr>{body}</table>" if body else above


def _cell(text: str) -> str:
    side = "right" if _is_number(text) else "left"
    cut = text if len(text) <= MOST_LETTERS else f"{text[:MOST_LETTERS]}..."
    return f'<td style="text-align: {side}">{escape(cut)}</td>'


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True
