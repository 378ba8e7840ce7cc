"""The command ``space-robot doctor``: what this machine has for flights."""

from __future__ import annotations

from typing import TYPE_CHECKING

import click

from .options import flight_option

if TYPE_CHECKING:
    from ..doctor import CheckedItem

WIDTH = 16
"""Characters of the longest name of a check."""


COLOURS = {"ok": "green", "warning": "yellow", "missing": "red"}


@click.command()
@flight_option("json")
def doctor(as_json: bool) -> None:
    """Check this machine: Python, ROS 2, clock, kernels, extras, compilers, browser.

    Each line is ok, a warning, or missing, with what to do. Nothing is flown; it takes a few
    seconds, two of which measure whether 2 kHz can be kept by the wall clock here. Exit code 0
    if flights in one process (`simulate`) can run, else 1. Attach the JSON to a bug report.

    \b
    Examples:
      space-robot doctor
      space-robot doctor --json > doctor.json
    """
    from ..console.terminal import echo_json
    from ..doctor import can_fly, can_fly_with_ros, examine
    from ..processes.software import commit, versions

    items: list[CheckedItem] = []
    for item in examine():
        items.append(item)
        if not as_json:
            _print(item)
    is_able, is_able_with_ros = can_fly(items), can_fly_with_ros(items)
    if as_json:
        echo_json(
            {
                "can_fly_in_process": is_able,
                "can_fly_with_ros": is_able_with_ros,
                "commit": commit(),
                "versions": versions(),
                "items": [item._asdict() for item in items],
            }
        )
    elif not is_able:
        click.echo("flights cannot run")
    elif not is_able_with_ros:
        click.echo("flights can run in one process (simulate), but not as ROS 2 nodes (fly)")
    else:
        click.echo("flights can run, in one process (simulate) and as ROS 2 nodes (fly)")
    click.get_current_context().exit(0 if is_able else 1)


def _print(item: CheckedItem) -> None:
    from space_robot_msgs_py.config.text import printable

    status = click.style(f"{item.status:8}", fg=COLOURS[item.status])
    click.echo(f"{status} {item.name + ':':{WIDTH}} {printable(item.text)}")
    if item.advice:
        click.echo(f"{'':8} {'':{WIDTH}} -> {printable(item.advice)}")
