"""Text from outside, made fit to be shown."""

from __future__ import annotations


def printable(text: str) -> str:
    """Return a text as one line, whatever a broken bag had for names."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)
