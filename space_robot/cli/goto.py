"""The command ``space-robot goto``: move tool, joints or base of a flight that is under way."""

from __future__ import annotations

import json
from typing import Any

import click

from .numbers import FiniteRange

SECTION = "Fly"


@click.command()
@click.option("--tool", metavar="X,Y,Z", help="Position of the tool, m.")
@click.option("--rpy", metavar="R,P,Y", help="Orientation of the tool, degrees.")
@click.option(
    "--frame",
    type=click.Choice(["start", "inertial", "base", "orbit"]),
    default="start",
    show_default=True,
    help="Of the tool's goal; start: relative to where the tool is; orbit: so, on its axes.",
)
@click.option("--joints", metavar="A,B,...", help="Positions of all joints, degrees or m.")
@click.option(
    "--base",
    metavar="R,P,Y|POINT",
    help="Attitude of the base, degrees, or what it points at: nadir, velocity, sun, target.",
)
@click.option(
    "--duration",
    type=FiniteRange(min=0.0, min_open=True),
    help="Seconds [default: as fast as the limits allow].",
)
@click.option(
    "--domain",
    type=click.IntRange(0, 232),
    help="ROS domain [default: ROS_DOMAIN_ID, or that of the only plant here].",
)
@click.option("--namespace", default="", metavar="NS", help="Of the robot, as /sat1.")
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
    from ..flight.graph.orchestrator import require_ros
    from ..flight.graph.simulation_calls import go_to

    require_ros()
    segment = _segment(**options)
    go_to(json.dumps(segment), domain, namespace)
    click.echo(f"flying {json.dumps(segment)}")


def _segment(
    tool: str | None,
    rpy: str | None,
    frame: str,
    joints: str | None,
    base: str | None,
    duration: float | None,
) -> dict[str, Any]:
    segment: dict[str, Any] = {"duration": duration or "fast"}
    if tool is not None or rpy is not None:
        goal: dict[str, Any] = {"frame": frame}
        if tool is not None:
            goal["xyz"] = _numbers(tool, "--tool", 3)
        if rpy is not None:
            goal["rpy_deg"] = _numbers(rpy, "--rpy", 3)
        segment["tool"] = goal
    if joints is not None:
        segment["joints_deg"] = _numbers(joints, "--joints")
    if base is not None:
        is_name = base.isalpha()
        segment["base"] = {"point": base} if is_name else {"rpy_deg": _numbers(base, "--base", 3)}
    if len(segment) == 1:
        raise click.UsageError("give --tool, --rpy, --joints or --base")
    return segment


def _numbers(text: str, option: str, count: int = 0) -> list[float]:
    try:
        numbers = [float(part) for part in text.split(",")]
    except ValueError:
        numbers = []
    if not numbers or (count and len(numbers) != count):
        expected = f"{count} numbers" if count else "numbers"
        raise click.BadParameter(
            f"{expected} separated by commas were expected, got {text!r}", param_hint=option
        )
    return numbers
