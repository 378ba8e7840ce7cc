"""The command ``space-robot view``: show flights in 3-D with plots on one page."""

from __future__ import annotations

import os
import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from .option_types import FiniteRange
from .options import excerpt_options, file_option

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog

SUFFIXES = (".html", ".htm")
NICENESS = 10
"""Niceness of the live viewer, so that it does not delay the graph."""
LIVE_ONLY = ("domain", "port")
BOTH_WAYS = ("live", "opens", "light", "namespace", "plots")


class PlotsOption(click.Option):
    """An option whose help has the names of the table of plotted quantities."""

    def get_help_record(self, ctx: click.Context) -> tuple[str, str] | None:
        """Return the option and its help."""
        from ..analysis.plotted import KINDS  # slow

        names = ", ".join(KINDS)
        self.help = (
            f"Shown first, of {names}; others can be chosen on the page [default: {USUAL_PLOTS}]."
        )
        return super().get_help_record(ctx)


USUAL_PLOTS = "errors, drift, torques, actuators"


@click.command()
@click.argument("bags", nargs=-1, type=click.Path(path_type=Path), metavar="[BAG...]")
@file_option(
    "--out", help="Page to write. An older one is replaced [default: <BAG>_view.html, here]."
)
@click.option("--open/--no-open", "opens", default=True, help="Open the page in a browser.")
@click.option(
    "--side-by-side",
    is_flag=True,
    help="A place for each robot [default: of one and the same robot all flights in one place].",
)
@click.option(
    "--rate",
    type=FiniteRange(0.0, 1e3, min_open=True),
    default=30.0,
    metavar="HZ",
    help="Poses a second of flight [default: 30]; fewer where the page grew beyond 3 MB.",
)
@click.option(
    "--robot",
    default="",
    metavar="NAME-or-FILE",
    help="The robot that flew, where the bag does not tell; a file of it with meshes.",
)
@click.option("--title", default="", help="Of the page [default: the bags' names].")
@click.option(
    "--plots",
    cls=PlotsOption,
    default="",
    metavar="KIND,...",
    help=f"Shown first [default: {USUAL_PLOTS}].",
)
@click.option("--light", is_flag=True, help="Dark on white, to print.")
@excerpt_options
@click.option("--live", is_flag=True, help="What flies now: serve the scene until Ctrl-C.")
@click.option(
    "--domain",
    type=int,
    help="ROS domain of the live graph [default: ROS_DOMAIN_ID, or that of this machine's newest "
    "flight].",
)
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8080,
    show_default=True,
    help="Of the live scene, on 127.0.0.1; if it is taken, the next one that is free.",
)
@click.pass_context
def view(
    context: click.Context,
    bags: tuple[Path, ...],
    out: Path | None,
    opens: bool,
    side_by_side: bool,
    rate: float,
    robot: str,
    title: str,
    plots: str,
    light: bool,
    read: Callable[[Path], FlightLog],
    live: bool,
    domain: int | None,
    port: int,
) -> None:
    """Show recorded flights in 3-D with synchronised plots on one HTML page.

    The page needs only a browser and no network. Play, scrub, or click a plot or a mark to go to
    that time. Several bags are drawn over one another, or side by side.

    With --live and no bag the same scene is served from a running graph, one flight after another.

    \b
    Examples:
      space-robot view flights/one
      space-robot view flights/tde_stc flights/ctc --out laws.html
      space-robot view flights/one flights/two --side-by-side --no-open
      space-robot view flights/mine --robot my.urdf --from 10 --to 12 --rate 200
      space-robot view flights/one --plots attitude,rates,wheels
      space-robot view --live
      space-robot view --live --domain 7 --namespace /sat1
    """
    from space_robot_msgs_py.errors import InputError

    from ..analysis.plotted import parse_kinds
    from ..api.flight_page import FlightPage, show_page
    from ..console.files import check_writable, make_folder
    from ..console.progress import counting_progress
    from ..view.flights import ViewOptions, flights_page, remarks_on, shown_robot
    from ..view.stage import check_viser
    from .analyze import bag_names

    _check_options(context, live, bags)
    kinds = parse_kinds(plots) if plots else ()
    check_viser()
    if live:
        _serve(opens, domain, context.params["namespace"] or "", port, not light, kinds)
        return
    names = bag_names(bags)
    page = out or Path(f"{'_'.join(names)}_view.html")
    if page.suffix not in SUFFIXES and not page.is_dir():
        raise InputError(f"--out {page}: a page's name ends in {' or '.join(SUFFIXES)}")
    make_folder(page.parent)
    check_writable(page)
    logs = {name: read(bag) for name, bag in zip(names, bags, strict=True)}
    robots = {name: shown_robot(log, robot) for name, log in logs.items()}
    for line in remarks_on(logs, robots):
        click.echo(line, err=True)
    options = ViewOptions(side_by_side, rate, title, not light, kinds)
    with counting_progress("drawing") as advance:
        html = flights_page(logs, robots, options, advance)
    show_page(FlightPage(html), page, opens)


def _check_options(context: click.Context, live: bool, bags: tuple[Path, ...]) -> None:
    """Refuse options of recorded flights for a live one, and the other way round."""
    from space_robot_msgs_py.errors import InputError

    if live == bool(bags):
        raise InputError("a BAG was expected, or --live without one")
    for option in context.command.params:
        name = option.name or ""
        is_typed = context.get_parameter_source(name) is ParameterSource.COMMANDLINE
        if is_typed and name not in ("bags", *BOTH_WAYS) and (name in LIVE_ONLY) != live:
            other = "recorded flights" if live else "--live"
            raise InputError(f"{option.opts[0]} is for {other} only")


def _serve(opens: bool, *settings: Any) -> None:
    from ..flight.graph.orchestrator import require_ros

    require_ros()
    click.echo("starting the scene ...", err=True)  # where much else runs, that takes a while
    from ..processes.interruption import Interrupted
    from ..view.live import serve

    events = serve(*settings)
    try:
        address = next(events)
        click.echo(f"the scene is at {address}; Ctrl-C ends", err=True)
        if opens:
            webbrowser.open(address)
        os.nice(NICENESS)
        for text in events:
            click.echo(text, err=True)
    except Interrupted:
        click.echo("ended", err=True)
