"""``space-robot soak``, for one more version: says what to use instead."""

from __future__ import annotations

import click


@click.command(hidden=True, context_settings={"ignore_unknown_options": True})
@click.argument("options", nargs=-1, type=click.UNPROCESSED)
def soak(options: tuple[str, ...]) -> None:
    """Say what to use instead of this command."""
    from space_robot_msgs_py.errors import InputError

    raise InputError("soak is a tool for developers now: make soak ARGS=... in the repository")
