"""The removed command ``space-robot sweep``: names its replacement."""

from __future__ import annotations

import shlex
from pathlib import Path

import click

SECTION = "Gains and studies"

POINTS = {"sensor_grades": 4, "base_actuators": 6}
"""Grid points of each campaign: one draw is this many runs."""


@click.command(hidden=True, context_settings={"ignore_unknown_options": True})
@click.option("--actuators", multiple=True)
@click.option("--draws", type=int)
@click.option("--seed", type=int)
@click.option("--jobs", type=int)
@click.option("--out", type=click.Path(path_type=Path))
@click.argument("others", nargs=-1, type=click.UNPROCESSED)
def sweep(
    actuators: tuple[str, ...],
    draws: int | None,
    seed: int | None,
    jobs: int | None,
    out: Path | None,
    others: tuple[str, ...],
) -> None:
    """Name the campaign that replaces this command."""
    from space_robot_msgs_py.config.files import named_file
    from space_robot_msgs_py.errors import InputError

    name = "base_actuators" if actuators else "sensor_grades"
    words = ["space-robot", "campaign", "run", name]
    for option, value in (
        ("--runs", draws and draws * POINTS[name]),
        ("--seed", seed),
        ("--workers", jobs),
        ("--out", out or f"campaigns/{name}"),
    ):
        if value is not None:
            words += [option, str(value)]
    line = f"sweep is a campaign now: {shlex.join(words)}"
    if options := [word.partition("=")[0] for word in others if word.startswith("--")]:
        line += (
            f" ({', '.join(dict.fromkeys(options))}: in a copy of {named_file('campaigns', name)})"
        )
    raise InputError(line)
