"""Types of options: finite numbers, lists of them, names of ``config/`` with their completion."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any

import click
from click.shell_completion import CompletionItem

Complete = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


class FiniteRange(click.FloatRange):
    """A `click.FloatRange` that refuses nan and infinities."""

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> float:
        """Convert a text to a number."""
        number: float = super().convert(value, param, ctx)
        if not math.isfinite(number):
            self.fail(f"{value} is not a finite number.", param, ctx)
        return number


class NumberList(click.ParamType[list[float]]):
    """Finite numbers separated by commas."""

    name = "numbers"

    def __init__(self, *counts: int) -> None:
        """Store how many numbers there may be; none: any."""
        self.counts = counts

    def convert(
        self, value: Any, param: click.Parameter | None, ctx: click.Context | None
    ) -> list[float]:
        """Convert a text to numbers."""
        try:
            numbers = [float(word) for word in value.split(",")]
        except ValueError:
            numbers = [math.nan]
        is_count = not self.counts or len(numbers) in self.counts
        if not is_count or not all(map(math.isfinite, numbers)):
            expected = f"{' or '.join(map(str, self.counts))} numbers".lstrip()
            self.fail(f"{expected} separated by commas were expected, got {value!r}", param, ctx)
        return numbers


def names_in(folder: str, others: Sequence[str] = ()) -> Complete:
    """Return the completion of a value: names of ``config/<folder>``, ``others``, or a path."""

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        from space_robot_msgs_py.config.installation import config_directory

        files = list((config_directory() / folder).iterdir())
        folders = [file.name for file in files if file.is_dir()]
        names = folders or [file.stem for file in files if file.suffix == ".yaml"]
        shown = [name for name in sorted({*others, *names}) if name.startswith(incomplete)]
        return [CompletionItem(name) for name in shown] or [CompletionItem(incomplete, type="file")]

    return complete
