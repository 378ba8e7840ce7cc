"""Advice for an unknown name: the allowed names, and the most similar ones."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from .text import printable

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
    text = printable(name[: LONGEST_SHOWN + 1])
    return text if len(text) <= LONGEST_SHOWN else f"{text[: LONGEST_SHOWN - 3]}..."


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
