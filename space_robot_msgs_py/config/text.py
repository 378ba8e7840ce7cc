"""Display and parsing of external texts."""

from __future__ import annotations

import json
from typing import Any


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
