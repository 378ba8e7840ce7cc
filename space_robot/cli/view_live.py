"""Live view of a running flight, served to browsers."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Collection

import click

NICENESS = 10
"""Niceness of the viewer, so that it does not delay the graph."""
OF_LIVE = ("domain", "port")
OF_BOTH = ("live", "opens", "robot", "light", "namespace", "plots")


def check_options(context: click.Context, live: bool, bags: Collection[object]) -> None:
    """Check that the options fit a recorded or a live flight.

    Raises:
        InputError: an option is for the other kind of flight.
    """
    from click.core import ParameterSource

    from space_robot_msgs_py.errors import InputError

    if live == bool(bags):
        raise InputError("a BAG was expected, or --live without one")
    for option in context.command.params:
        name = option.name or ""
        is_typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if is_typed and name not in ("bags", *OF_BOTH) and (name in OF_LIVE) != live:
            other = "recorded flights" if live else "--live"
            raise InputError(f"{option.opts[0]} is for {other} only")


def serve_live(
    domain: int | None,
    namespace: str | None,
    robot: str,
    port: int,
    light: bool,
    opens: bool,
    plots: tuple[str, ...],
) -> None:
    """Serve the scene until the user ends it; its arguments are the command's options."""
    from ..flight.graph.orchestrator import require_ros

    require_ros()
    click.echo("starting the scene ...", err=True)  # where much else runs, that takes a while
    from space_robot_model.robot.find import robot_as_path

    from ..processes.interruption import Interrupted
    from ..view.live.serve import LiveOptions, serve

    def say(text: str) -> None:
        click.echo(text, err=True)

    def ready(address: str) -> None:
        say(f"the scene is at {address}; Ctrl-C ends")
        if opens:
            webbrowser.open(address)
        os.nice(NICENESS)

    named = robot_as_path(robot) if robot else ""
    try:
        serve(LiveOptions(domain, namespace or "", named, port, not light, plots), say, ready)
    except Interrupted:
        say("ended")
