"""Completion of names of ``config/`` in a shell."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import click
from click.shell_completion import CompletionItem

Complete = Callable[[click.Context, click.Parameter, str], list[CompletionItem]]


def names_in(folder: str, others: Sequence[str] = ()) -> Complete:
    """Return the completion of a value that is a name of ``config/<folder>`` or a path.

    Args:
        folder: with a YAML file of each name, or a folder of each name.
        others: further names.
    """

    def complete(
        context: click.Context, parameter: click.Parameter, incomplete: str
    ) -> list[CompletionItem]:
        names = sorted({*others, *config_names(folder)})
        items = [CompletionItem(name) for name in names if name.startswith(incomplete)]
        return items or [CompletionItem(incomplete, type="file")]

    return complete


def config_names(folder: str) -> list[str]:
    """Return the names of the folders in ``config/<folder>``; if none, those of its YAML files."""
    from space_robot_msgs_py.config.installation import config_directory

    files = list((config_directory() / folder).iterdir())
    folders = [file.name for file in files if file.is_dir()]
    return sorted(folders or (file.stem for file in files if file.suffix == ".yaml"))
