"""Advice for an unknown name: the names that are allowed, and the nearest of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .text import printable

MOST_LISTED = 20
"""Names that an error lists; of more it names the nearest ones."""
MOST_NEAR = 3
"""Names suggested in the place of an unknown one."""
SHORTEST_PART = 3
"""Characters of a part of a name that names it."""
LONGEST_SHOWN = 80
"""Characters of a name."""
LONGEST_COMPARED, MOST_COMPARED = 60, 2_000
"""Characters of a name, and names, that are compared: the time grows with both."""


def choices(name: str, allowed: Iterable[str], also: str = "", listing: str = "") -> str:
    """Return the end of an error about an unknown name: the names allowed, and the nearest.

    Args:
        name: the unknown one.
        allowed: all names that are known.
        also: what else is allowed, as ``, or a path to a .yaml file``.
        listing: the option or command that lists all names, as ``--fault list``.
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
    text = printable(name[: LONGEST_SHOWN + 1])
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}..."


def nearest(name: str, allowed: Sequence[str]) -> list[str]:
    """Return the allowed names that are spelt most like ``name``, or else contain it."""
    from difflib import get_close_matches  # wanted for errors only

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
