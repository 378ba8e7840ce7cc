"""``space-robot sim``: pause, step and reset of a running graph."""

from __future__ import annotations

from typing import Any

import click

SECTION = "Fly"


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
