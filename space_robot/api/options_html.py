"""Options of a flight as a table for notebooks."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import short

from ..scenario.option_table import OPTIONS


def options_html(options: Mapping[str, Any]) -> str:
    """Return the table of options, by name, with the default of each."""
    rows = [[name, _text(value), _default(name)] for name, value in options.items()]
    caption = "Scenario" if rows else "Scenario: all options have their defaults"
    return html_table(("option", "value", "default"), rows, caption)


def _text(value: object) -> str:
    """Return a value as text: of a robot or a law its name."""
    if isinstance(value, str):
        return value
    name = getattr(value, "name", None) or getattr(value, "__name__", None)
    return name if isinstance(name, str) else short(value)


def _default(name: str) -> str:
    """Return the default of an option in the words of its help."""
    for entry in OPTIONS:
        if entry.name == name:
            return entry.default_text or ("none" if entry.default is None else str(entry.default))
    return "none"
