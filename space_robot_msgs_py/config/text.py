"""Words of others in words of ours."""

from __future__ import annotations


def printable(text: str) -> str:
    """One line, whatever a broken bag had for names."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
