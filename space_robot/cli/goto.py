"""The command ``space-robot goto``: move tool, joints or base of a flight that is under way."""

from __future__ import annotations

import json
from typing import Any

import click

from .numbers import FiniteRange, NumberList
from .sim import graph_options

SECTION = "Fly"


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
def goto(domain: int | None, namespace: str, **options: Any) -> None:
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
    segment = _segment(**options)
    go_to(json.dumps(segment), domain, namespace)
    click.echo(f"flying {json.dumps(segment)}")


def _segment(
    tool: list[float] | None,
    rpy: list[float] | None,
    frame: str,
    joints: list[float] | None,
    base: dict[str, Any] | None,
    duration: float | None,
) -> dict[str, Any]:
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
    return segment
