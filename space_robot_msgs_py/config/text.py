"""Text from outside, made fit to be shown."""

from __future__ import annotations


def printable(text: str) -> str:
    """Return a text as one line, whatever a broken bag had for names."""
    return "".join(letter if letter.isprintable() else "?" for letter in text)


def one_line_of(error: BaseException) -> str:
    """Return the type of a program's error and its first words, in one line."""
    text = printable(" ".join(str(error).split()))
    return f"{type(error).__name__}: {text}"[:300].removesuffix(": ")


def shortened(text: str, most: int) -> str:
    """Return a text of at most ``most`` letters: a longer one has "..." in place of its middle."""
    if len(text) <= most:
        return text
    end = (most - 3) // 2
    return f"{text[: most - 3 - end]}...{text[len(text) - end :]}"
