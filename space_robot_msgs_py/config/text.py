"""Texts for people: errors in one line, advice for unknown names, tables in HTML."""

from __future__ import annotations

import json
from collections.abc import Iterable, Sequence
from html import escape
from typing import Any

MOST_LISTED = 20
"""Maximum number of names listed by an error; of more only the most similar ones."""
MOST_NEAR = 3
"""Maximum number of suggested names."""
SHORTEST_PART = 3
"""Minimum length of a part of a name that is searched in other names."""
LONGEST_SHOWN = 80
"""Maximum displayed characters of a name."""
LONGEST_COMPARED, MOST_COMPARED = 60, 2_000
"""Maximum length and number of compared names, since the time grows with both."""
MOST_LETTERS = 200
"""Maximum displayed characters of a cell of an HTML table."""


def printable(text: str) -> str:
    """Return a text as one printable line, for example names from a damaged bag."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def one_line_of(error: BaseException) -> str:
    """Return type and beginning of the message of an exception, in one line."""
    text = printable(" ".join(str(error).split()))
    return f"{type(error).__name__}: {text}"[:300].removesuffix(": ")


def shortened(text: str, most: int) -> str:
    """Shorten a text to at most ``most`` characters, with "..." in its middle."""
    if len(text) <= most:
        return text
    end = (most - 3) // 2
    return f"{text[: most - 3 - end]}...{text[len(text) - end :]}"


def parse_json(text: str) -> Any:
    """Parse a JSON text of unknown origin.

    Raises:
        ValueError: it is not JSON, or nested deeper than Python's parser follows.
    """
    try:
        return json.loads(text)
    except RecursionError:
        raise ValueError("nested too deeply") from None


def choices(name: str, allowed: Iterable[str], also: str = "", listing: str = "") -> str:
    """Return the end of an error about an unknown name: allowed and most similar names.

    Args:
        name: the unknown one.
        allowed: all allowed names.
        also: other allowed values, such as ``, or a path to a .yaml file``.
        listing: the option or command that lists all names, such as ``--fault list``.
    """
    names = list(allowed)
    near = [_shown(other) for other in nearest(name, names)]
    suggestion = f"did you mean {', '.join([*near[:-2], ' or '.join(near[-2:])])}?" if near else ""
    first = ", ".join(map(_shown, names[:MOST_LISTED]))
    count = f"{listing} lists all {len(names)}" if listing else f"{len(names)} in all"
    if len(names) <= MOST_LISTED:
        listed = f"choose one of {first}{also}"
        return f"{listed} ({suggestion})" if near else listed
    if near:
        return f"{suggestion} ({count}{also})"
    if listing:
        return f"{count}{also}"
    return f"choose one of {first}, ... ({count}){also}"


def _shown(name: str) -> str:
    return printable(shortened(name, LONGEST_SHOWN))


def nearest(name: str, allowed: Sequence[str]) -> list[str]:
    """Return the allowed names with the most similar spelling, else those containing ``name``."""
    from difflib import get_close_matches  # needed for errors only

    if len(name) > LONGEST_COMPARED:
        return []
    by_spelling: dict[str, str] = {}
    for other in allowed[:MOST_COMPARED]:
        if len(other) <= LONGEST_COMPARED:
            by_spelling.setdefault(other.lower(), other)
    if name.lower() in by_spelling:
        return [by_spelling[name.lower()]]
    near = get_close_matches(name.lower(), by_spelling, MOST_NEAR)
    if not near and len(name) >= SHORTEST_PART:
        near = [spelling for spelling in by_spelling if name.lower() in spelling][:MOST_NEAR]
    return [by_spelling[spelling] for spelling in near]


def html_table(heads: Sequence[str], rows: Iterable[Sequence[str]], caption: str = "") -> str:
    """Return a table below a caption; cells that are numbers are aligned right, all others left."""
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
