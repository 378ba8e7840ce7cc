"""Progress lines on standard error, for flights and for series of tasks."""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager

from rich.progress import (
    BarColumn,
    Progress,
    ProgressColumn,
    Task,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)
from rich.text import Text

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .terminal import say, terminal

LINE_S = 60.0
"""Time between two lines in a file, where no line can be redrawn."""
WATCH_S, WATCHED_LINE_S = 0.5, 5.0
"""Time between two counts of watched tasks, and between two lines about them."""
DONE_OF_TOTAL = "{task.completed:.0f}/{task.total:.0f}"


class FlightProgress:
    """Progress line on standard error; call it with the simulated time, s, and a remark."""

    def __init__(self, progress: Progress, total_s: float, what: str) -> None:
        self._progress = progress
        self._task = progress.add_task(what, total=total_s, remark="")

    def __call__(self, simulated_s: float, remark: str = "") -> None:
        """Show the simulated time."""
        self._progress.update(self._task, completed=simulated_s, remark=remark)

    def say(self, text: str) -> None:
        """Print a permanent line above the progress."""
        say(self._progress.console, text)


@contextmanager
def flight_progress(total_s: float, what: str) -> Iterator[FlightProgress]:
    """Show a progress line for a flight of ``total_s`` seconds."""
    with _bar("{task.completed:.1f}/{task.total:.1f} s simulated", _remark()) as progress:
        yield FlightProgress(progress, total_s, what)


@contextmanager
def counting_progress(
    what: str, is_transient: bool = False
) -> Iterator[Callable[[int], Callable[[], None]]]:
    """Show a progress line for a series of tasks; ``is_transient``: it is removed at the end.

    Yields:
        A function that takes the number of tasks, and returns a function to call after each task.
    """
    with ExitStack() as stack:

        def begin(total: int) -> Callable[[], None]:
            progress = stack.enter_context(_bar(DONE_OF_TOTAL, is_transient=is_transient))
            task = progress.add_task(what, total=total)
            return lambda: progress.advance(task)

        yield begin


@contextmanager
def rated_progress(what: str, line_s: float = LINE_S) -> Iterator[Callable[..., None]]:
    """Show a progress line with rate and remaining time for many tasks, from the first call on.

    In a file, such as the log of a cluster job, it is a line every ``line_s`` seconds.

    Yields:
        A function of the number of done tasks, the total number, and a remark.
    """
    with ExitStack() as stack:
        progress: Progress | None = None
        console, shown_at = terminal(stderr=True), time.monotonic()

        def show(done: int, total: int, remark: str = "") -> None:
            nonlocal progress, shown_at
            if not console.is_terminal and time.monotonic() >= shown_at + line_s:
                shown_at = time.monotonic()
                say(console, ", ".join(filter(None, (f"{what} {done}/{total}", remark))))
            if progress is None:
                remaining = TimeRemainingColumn(compact=True)
                progress = stack.enter_context(_bar(DONE_OF_TOTAL, _Rate(), remaining, _remark()))
                progress.add_task(what, completed=done, total=total, remark=remark)
            else:
                progress.update(progress.task_ids[0], completed=done, total=total, remark=remark)

        yield show


def check_progress(progress: object) -> None:
    """Check the argument ``progress`` of a function: a function, a truth value or None.

    Raises:
        InputError: it is something else.
    """
    if not (progress is None or isinstance(progress, bool) or callable(progress)):
        raise InputError(
            f"progress: a function was expected, or True for a progress line, got {short(progress)}"
        )


@contextmanager
def watching_progress(what: str, total: int, count: Callable[[], int]) -> Iterator[None]:
    """Show a progress line for tasks of other processes; ``count`` returns how many are done."""
    is_over = threading.Event()

    def watch() -> None:
        while not is_over.wait(WATCH_S):
            show(count(), total)

    with rated_progress(what, WATCHED_LINE_S) as show:
        show(count(), total)
        watcher = threading.Thread(target=watch, daemon=True)
        watcher.start()
        try:
            yield
        finally:
            is_over.set()
            watcher.join()
        show(total, total)


class _Rate(ProgressColumn):
    def render(self, task: Task) -> Text:
        """Return the recent rate of tasks per second."""
        speed = task.finished_speed or task.speed
        return Text(f"{speed:.3g}/s" if speed else "")


def _remark() -> TextColumn:
    return TextColumn("{task.fields[remark]}", markup=False)


def _bar(done: str, *more: ProgressColumn, is_transient: bool = False) -> Progress:
    """Return a line with a bar; ``done`` is the format of the progress beside it."""
    return Progress(
        TextColumn("{task.description}", markup=False),
        BarColumn(bar_width=24),
        TextColumn(done),
        TimeElapsedColumn(),
        *more,
        console=terminal(stderr=True),
        refresh_per_second=5,
        transient=is_transient,
    )
