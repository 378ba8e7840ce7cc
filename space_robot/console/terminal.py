"""Text and JSON on a terminal.

Texts from bags and users are never interpreted as markup, and unprintable characters are replaced.
"""

from __future__ import annotations

import json
import math
from typing import Any

import click
from rich.console import Console
from rich.text import Text

from space_robot_msgs_py.config.text import printable


class _Console(Console):
    def render_str(self, text: str, **options: Any) -> Text:
        """Make all displayed text printable: sentences, titles and cells."""
        return super().render_str("\n".join(map(printable, text.split("\n"))), **options)


def terminal(**options: Any) -> Console:
    """Return a console without markup; ``options`` are those of `rich.console.Console`.

    In a notebook it prints text, too: rich's HTML for notebooks has a fixed width.
    """
    return _Console(markup=False, emoji=False, highlight=False, force_jupyter=False, **options)


def say(console: Console, text: str) -> None:
    """Print a text as one line; the terminal wraps it."""
    console.print(text, soft_wrap=True)


def echo_json(report: Any) -> None:
    """Print a report as JSON; NaN and infinity become null."""
    click.echo(json_text(report))


def json_text(report: Any) -> str:
    """Return a report as JSON; NaN and infinity become null."""
    return json.dumps(_finite(report), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, dict):
        return {key: _finite(inner) for key, inner in value.items()}
    if isinstance(value, (list, tuple)):
        return [_finite(inner) for inner in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
