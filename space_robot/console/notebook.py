"""Progress in a notebook: one output of a cell, which is updated."""

from __future__ import annotations

import sys
import time
from html import escape
from importlib import import_module
from typing import Any

from rich.progress import BarColumn, Progress, ProgressColumn, Task
from rich.text import Text

from .terminal import terminal

UPDATE_S = 0.2
"""Shortest time between two updates."""
STYLE = "font-family: monospace; white-space: pre"


def is_in_notebook() -> bool:
    """Return True in a process whose outputs are shown by Jupyter."""
    ipython = sys.modules.get("IPython")
    shell = ipython.get_ipython() if ipython else None
    return getattr(shell, "kernel", None) is not None


class NotebookProgress(Progress):
    """A progress line as HTML.

    rich's own needs ipywidgets in a notebook, and where they are missing prints a warning instead.
    """

    def __init__(self, *columns: str | ProgressColumn, is_transient: bool = False) -> None:
        """Store the columns; a `BarColumn` becomes the browser's progress bar.

        Args:
            columns: of the line.
            is_transient: whether it is removed at the end.
        """
        super().__init__(*columns, console=terminal(stderr=True), disable=True)
        self._display: Any = None
        self._is_transient = is_transient
        self._updated_at = 0.0

    def start(self) -> None:
        """Add the output to the cell."""
        display: Any = import_module("IPython.display").display  # without types
        self._display = display(self._bundle(), raw=True, display_id=True)

    def stop(self) -> None:
        """Show the last state, or nothing."""
        if self._is_transient:
            for task in self.task_ids:
                self.remove_task(task)
        self._show()

    def refresh(self) -> None:
        """Show the present state, unless this was done a moment ago."""
        if time.monotonic() >= self._updated_at + UPDATE_S:
            self._show()

    def update(self, *args: Any, **options: Any) -> None:
        """Update a task as `Progress` does, and show it."""
        super().update(*args, **options)
        self.refresh()

    def advance(self, *args: Any, **options: Any) -> None:
        """Advance a task as `Progress` does, and show it."""
        super().advance(*args, **options)
        self.refresh()

    def _show(self) -> None:
        if self._display is not None:
            self._updated_at = time.monotonic()
            self._display.update(self._bundle(), raw=True)

    def _bundle(self) -> dict[str, str]:
        lines = [[self._cell(column, task) for column in self.columns] for task in self.tasks]
        html = "".join(
            f'<div style="{STYLE}">{" ".join(html for html, _ in line)}</div>' for line in lines
        )
        plain = "\n".join(" ".join(filter(None, (text for _, text in line))) for line in lines)
        return {"text/html": html, "text/plain": plain}

    def _cell(self, column: str | ProgressColumn, task: Task) -> tuple[str, str]:
        """Return a column as HTML and as text."""
        if isinstance(column, BarColumn):
            value = f' value="{task.completed:g}" max="{task.total:g}"' if task.total else ""
            return f"<progress{value}></progress>", ""
        shown = column.format(task=task) if isinstance(column, str) else column(task)
        text = shown.plain if isinstance(shown, Text) else str(shown)
        return escape(text), text
