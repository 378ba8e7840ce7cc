"""The removed command ``space-robot soak``: names its replacement."""

from __future__ import annotations

import click

SECTION = "Gains and studies"


@click.command(hidden=True, context_settings={"ignore_unknown_options": True})
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def soak(options: tuple[str, ...]) -> None:
    """Name the replacement of this command."""
    from space_robot_msgs_py.errors import InputError

    raise InputError("soak is a tool for developers now: make soak ARGS=... in the repository")
