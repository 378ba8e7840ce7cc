"""The command ``space-robot analyze``."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from contextlib import ExitStack
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import TYPE_CHECKING, Any

import click

from space_robot_msgs_py.config.text import printable

from .options import excerpt_options, file_option, folder_option

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog

    from ..analysis.own_metric import OwnMetric
    from ..analysis.sizing import ActuatorSet


@click.command()
@click.argument("bags", nargs=-1, required=True, type=click.Path(path_type=Path), metavar="BAG...")
@folder_option("--plot", help="Folder for the figures; several bags overlaid.")
@click.option(
    "--format",
    "formats",
    multiple=True,
    type=click.Choice(["png", "svg", "pdf"]),
    help="Of the figures; may be repeated [default: png, svg].",
)
@click.option(
    "--width",
    metavar="single|double|MM",
    help="Of the figures, for a paper: one column (88.9 mm), two (181.9 mm), or mm "
    "[default: 180, with titles].",
)
@click.option(
    "--csv",
    type=click.Path(path_type=Path),
    metavar="DIR-or-FILE",
    help="Every tick's numbers as <bag>.csv in a folder, or of one bag as FILE.csv.",
)
@click.option(
    "--parquet",
    type=click.Path(path_type=Path),
    metavar="DIR-or-FILE",
    help="The same as Parquet, with the flight's description.",
)
@file_option("--html", help="One page with tables and figures, to send to a colleague.")
@file_option("--latex", help="The main results as a LaTeX table, for a paper.")
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    metavar="FILE.py:FUNCTION",
    help="A number of your own: what the function returns for the flight's log; may be repeated. "
    "NAME=FILE.py:FUNCTION names it.",
)
@click.option(
    "--actuators",
    metavar="NAME-or-FILE",
    help="Whether these would have what each flight asks of its base (default: those that flew).",
)
@click.option(
    "--band",
    "band_deg",
    type=click.FloatRange(0.0, 180.0, min_open=True),
    metavar="DEG",
    help="Angle within which the base points well, degrees (default: 0.1).",
)
@click.option(
    "--window",
    "window_s",
    type=click.FloatRange(0.0, 1e6, min_open=True),
    metavar="S",
    help="Window over which the base's jitter counts, s (default: 1).",
)
@excerpt_options
@click.option(
    "--json", "as_json", is_flag=True, help="Print the report as JSON: a list of several."
)
def analyze(
    bags: tuple[Path, ...],
    plot: Path | None,
    formats: tuple[str, ...],
    width: str | None,
    csv: Path | None,
    parquet: Path | None,
    html: Path | None,
    latex: Path | None,
    metrics: tuple[str, ...],
    actuators: str | None,
    band_deg: float | None,
    window_s: float | None,
    read: Callable[[Path], FlightLog],
    as_json: bool,
) -> None:
    """Metrics of recorded flights: one bag, or several side by side.

    RMS, maxima, settling, chatter, saturation, latency, the error of the time-delay estimate,
    pointing of base and end effector, and the loads on the base. docs/manual/analysis.md explains
    each metric. Modules and files that a bag names are not opened without --trust.

    \b
    Examples:
      space-robot analyze flights/one
      space-robot analyze flights/one flights/two --plot figures --html flights.html
      space-robot analyze flights/one --plot figures --width single --format pdf
      space-robot analyze flights/one --from 14 --to 16 --json
      space-robot analyze flights/one --actuators wheels
      space-robot analyze flights/one --band 0.05 --window 10
      space-robot analyze flights/one --metric my_metrics.py:overshoot
      space-robot analyze flights/one --parquet one.parquet
      space-robot analyze theirs --remap /arm/joint_states:=/joint_states
      space-robot analyze both --namespace /sat1
    """
    from ..analysis import analyze
    from ..analysis.analysed_log import PointingBudget
    from ..analysis.export import check_parquet, write_csv, write_parquet
    from ..console.files import check_free, write_text

    if parquet:
        check_parquet()
    own = own_metrics(metrics)
    names = bag_names(bags)
    exports = [
        (write, dict(zip(names, _files(where, names, suffix), strict=True)))
        for write, where, suffix in ((write_csv, csv, ".csv"), (write_parquet, parquet, ".parquet"))
        if where
    ]
    for path in (
        *(path for _, paths in exports for path in paths.values()),
        *filter(None, (html, latex)),
    ):
        check_free(path)
    settings = {"band_deg": band_deg, "window_s": window_s}
    budget = PointingBudget.model_validate({k: v for k, v in settings.items() if v is not None})
    figure_set = None
    if not plot and (formats or width):
        raise click.UsageError("--format and --width need --plot")
    if plot or html:
        from ..analysis.figures.figure_set import FigureSet
        from ..analysis.figures.style import parse_width

        figure_set = FigureSet(budget, parse_width(width) if width else None)
    reports: dict[str, dict[str, Any]] = {}
    descriptions: dict[str, dict[str, Any]] = {}
    for name, bag in zip(names, bags, strict=True):
        log = read(bag)
        reports[name] = analyze(log, _actuator_set(log, actuators), budget)
        descriptions[name] = log.flight
        if own:
            reports[name]["metrics"] |= {m.name: m.finite_value(log) for m in own}
        for write, paths in exports:
            write(log, paths[name])
            click.echo(f"wrote {paths[name]}", err=True)
        if figure_set:
            figure_set.add(name, log)
        del log  # before the next is read: a long flight fills a gigabyte
    with ExitStack() as stack:
        if figure_set:
            formats = formats or ("png", "svg")
            if plot:
                figures = figure_set.save(plot, formats)
                files = ", ".join(str(figure.files[0]) for figure in figures)
                others = " and ".join(["", *(f".{suffix}" for suffix in formats[1:])])
                click.echo(f"wrote {files}{others}", err=True)
            if html:
                from ..analysis.report import render

                if not plot or "svg" not in formats:
                    folder = Path(stack.enter_context(TemporaryDirectory()))
                    figures = figure_set.save(folder, ["svg"])
                shown = [(figure.caption, figure.data_uri) for figure in figures]
                write_text(render(reports, descriptions, shown), html)
                click.echo(f"wrote {html}", err=True)
    if latex:
        from ..analysis.report_tables import latex_table

        write_text(latex_table(reports, descriptions), latex)
        click.echo(f"wrote {latex}", err=True)
    _print(reports, as_json)


def own_metrics(texts: Sequence[str]) -> list[OwnMetric]:
    """Import the functions of ``--metric``.

    Raises:
        InputError: one cannot be imported, or two have the same name.
    """
    if not texts:
        return []
    from space_robot_msgs_py.errors import InputError

    from ..analysis.own_metric import parse

    own = [parse(text) for text in texts]
    names = [metric.name for metric in own]
    if twice := [name for name in names if names.count(name) > 1]:
        raise InputError(
            f"--metric: {twice[0]} is the name of two: name one as OTHER=FILE.py:FUNCTION"
        )
    return own


def _actuator_set(log: FlightLog, name: str | None) -> ActuatorSet | None:
    """Read the set of base actuators to compare a flight with.

    Raises:
        InputError: the set does not exist or does not fit the robot.
    """
    if name is None:
        return None
    from space_robot_control.allocation.settings import assumed_actuators

    from ..analysis.described import flown_robot
    from ..analysis.sizing import ActuatorSet

    return ActuatorSet(name, assumed_actuators(name, flown_robot(log)))


def _print(reports: dict[str, dict[str, Any]], as_json: bool) -> None:
    from ..console.terminal import echo_json, terminal

    if as_json:
        reports_shown = list(reports.values())
        echo_json(reports_shown[0] if len(reports_shown) == 1 else reports_shown)
        return
    from ..analysis.report_tables import metrics_table, rms_table, sizing_table
    from ..console.terminal import print_table
    from .report_display import print_comparison

    console = terminal()
    if len(reports) > 1:
        print_comparison(reports, console)
        return
    for report in reports.values():
        print_table(rms_table(report), console)
        print_table(metrics_table(report), console)
        if table := sizing_table(report):
            print_table(table, console)


def bag_names(bags: Sequence[Path]) -> list[str]:
    """Name each bag by its folder, with as many parent folders as make names unique."""
    paths = [Path(printable(str(bag.absolute()))) for bag in bags]
    if len(set(paths)) < len(paths):
        raise click.BadParameter("the same bag was given twice", param_hint="BAG...")
    for length in range(1, max(len(path.parts) for path in paths)):
        names = ["_".join(path.parts[-length:]) for path in paths]
        if len(set(names)) == len(names):
            return names
    return [str(path) for path in paths]


def _files(where: Path, names: Sequence[str], suffix: str) -> list[Path]:
    """Return a file per bag: ``where`` itself if it names a file, else files in it."""
    if where.suffix != suffix or where.is_dir():
        return [where / f"{name}{suffix}" for name in names]
    if len(names) > 1:
        raise click.BadParameter(f"{where}: one file for {len(names)} bags: name a folder")
    return [where]
