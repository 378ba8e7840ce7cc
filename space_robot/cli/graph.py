"""The commands ``space-robot sim`` and ``goto``, for a graph of nodes that flies."""

from __future__ import annotations

import json
from typing import Any

import click

from .option_types import FiniteRange, NumberList


def graph_options(function: Any) -> Any:
    """Give a command the options that select a graph."""
    namespace = click.option(
        "--namespace", default="", metavar="NS", help="Of the robot, as /sat1."
    )
    domain = click.option(
        "--domain",
        type=click.IntRange(0, 232),
        help="ROS domain [default: ROS_DOMAIN_ID, or that of the only plant here].",
    )
    return domain(namespace(function))


@click.group()
def sim() -> None:
    """Pause, step, resume or reset a running graph of nodes.

    The commands call services of the plant node, for users without `ros2 service call`.

    \b
    Examples:
      space-robot fly --paused --domain 7
      space-robot sim step --ticks 10 --domain 7
      space-robot sim resume --domain 7
    """


@sim.command()
@graph_options
def pause(**options: Any) -> None:
    """Hold the plant at its present tick; watchdogs ignore the pause."""
    _call("pause", **options)


@sim.command()
@graph_options
def resume(**options: Any) -> None:
    """Resume a paused plant."""
    _call("resume", **options)


@sim.command()
@click.option("--ticks", type=int, default=1, show_default=True, help="Ticks to go on.")
@graph_options
def step(**options: Any) -> None:
    """Advance a paused plant by some ticks; return when it is paused again."""
    _call("step", **options)


@sim.command()
@graph_options
def reset(**options: Any) -> None:
    """Reset the whole graph to tick 0; a paused graph stays paused.

    Plant, controller, mission and recorder start again. The recorder closes its bag and renames
    it to BAG_before_reset_1; the new flight is recorded to BAG, from tick 0.
    """
    _call("reset", **options)


def _call(action: str, **options: Any) -> None:
    from ..flight.graph.node_services import call_simulation
    from ..flight.graph.orchestrator import require_ros

    require_ros()
    click.echo(call_simulation(action, **options))


def _attitude(
    context: click.Context, option: click.Parameter, text: str | None
) -> dict[str, Any] | None:
    if text is None:
        return None
    if text.isalpha():
        return {"point": text}
    return {"rpy_deg": NumberList(3).convert(text, option, context)}


@click.command()
@click.option("--tool", type=NumberList(3), metavar="X,Y,Z", help="Position of the tool, m.")
@click.option(
    "--rpy", type=NumberList(3), metavar="R,P,Y", help="Orientation of the tool, degrees."
)
@click.option(
    "--frame",
    type=click.Choice(["start", "inertial", "base", "orbit"]),
    default="start",
    show_default=True,
    help="Of the tool's goal; start: relative to where the tool is; orbit: so, on its axes.",
)
@click.option(
    "--joints", type=NumberList(), metavar="A,B,...", help="Positions of all joints, degrees or m."
)
@click.option(
    "--base",
    callback=_attitude,
    metavar="R,P,Y|POINT",
    help="Attitude of the base, degrees, or what it points at: nadir, velocity, sun, target.",
)
@click.option(
    "--duration",
    type=FiniteRange(min=0.0, min_open=True),
    help="Seconds [default: as fast as the limits allow].",
)
@graph_options
def goto(
    domain: int | None,
    namespace: str,
    tool: list[float] | None,
    rpy: list[float] | None,
    frame: str,
    joints: list[float] | None,
    base: dict[str, Any] | None,
    duration: float | None,
) -> None:
    """Move the tool, the joints or the base of a robot that flies on a graph.

    The motion replaces the rest of the mission. A reference that moves is brought to rest first,
    within 2 s, but for a base that points. What cannot be flown is refused in one line with exit
    code 1, and the flight goes on as it was.

    \b
    Examples:
      space-robot goto --tool 0.2,0,-0.1 --duration 8
      space-robot goto --tool 1.9,0,2.4 --rpy 0,20,0 --frame inertial --duration 10
      space-robot goto --joints 0,120,220,0,-10,0 --base 0,0,10 --duration 20
      space-robot goto --base nadir --duration 120
    """
    from ..flight.graph.node_services import go_to
    from ..flight.graph.orchestrator import require_ros

    require_ros()
    segment: dict[str, Any] = {"duration": duration or "fast"}
    if tool or rpy:
        goal = {"frame": frame, "xyz": tool, "rpy_deg": rpy}
        segment["tool"] = {key: value for key, value in goal.items() if value}
    if joints:
        segment["joints_deg"] = joints
    if base:
        segment["base"] = base
    if len(segment) == 1:
        raise click.UsageError("give --tool, --rpy, --joints or --base")
    text = json.dumps(segment)
    go_to(text, domain, namespace)
    click.echo(f"flying {text}")
