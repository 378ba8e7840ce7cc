"""Progress lines on standard error, for flights and for things done one by one."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn

from .terminal import say, terminal


class FlightProgress:
    """A progress line on standard error; call it with simulated seconds and a remark."""

    def __init__(self, progress: Progress, total_s: float, what: str) -> None:
        self._progress = progress
        self._task = progress.add_task(what, total=total_s, remark="")

    def __call__(self, simulated_s: float, remark: str = "") -> None:
        """Show how far the flight is."""
        self._progress.update(self._task, completed=simulated_s, remark=remark)

    def say(self, text: str) -> None:
        """A line above the progress, which stays."""
        say(self._progress.console, text)


@contextmanager
def flight_progress(total_s: float, what: str) -> Iterator[FlightProgress]:
    """A progress line for a flight of ``total_s``."""
    remark = TextColumn("{task.fields[remark]}", markup=False)
    with _bar("{task.completed:.1f}/{task.total:.1f} s simulated", remark) as progress:
        yield FlightProgress(progress, total_s, what)


@contextmanager
def counting_progress(what: str) -> Iterator[Callable[[int], Callable[[], None]]]:
    """A progress line for things that are done one by one; see `reproduce` for its use."""
    with ExitStack() as stack:

        def begin(total: int) -> Callable[[], None]:
            progress = stack.enter_context(_bar("{task.completed:.0f}/{task.total:.0f}"))
            task = progress.add_task(what, total=total)
            return lambda: progress.advance(task)

        yield begin


def _bar(done: str, *more: TextColumn) -> Progress:
    """Make a line with a bar; ``done`` beside it tells how far things are."""
    return Progress(
        TextColumn("{task.description}", markup=False), BarColumn(bar_width=24), TextColumn(done),
        TimeElapsedColumn(), *more, console=terminal(stderr=True), refresh_per_second=5,
    )  # fmt: skip
