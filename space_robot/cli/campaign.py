"""The command ``space-robot campaign``: run many flights, repeat one, report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from .option_types import FiniteRange, names_in
from .options import WORKERS, file_option, flight_option, folder_option

if TYPE_CHECKING:
    from ..campaign.flown.flights import Progress


@click.group()
def campaign() -> None:
    """Fly thousands of dispersed flights and test requirements with confidence.

    \b
    Examples:
      space-robot campaign run first --runs 200 --seed 7 --out campaigns/a
      space-robot campaign rerun campaigns/a 47 --bag flights/47
      space-robot campaign report campaigns/a --html a.html
    """


FOLDER = click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")


@campaign.command()
@click.argument("file", shell_complete=names_in("campaigns"))
@click.option(
    "--runs",
    type=click.IntRange(1),
    metavar="N",
    help="Draws of all that is varied, each flown by every law [default: the file's].",
)
@click.option(
    "--seed", type=click.IntRange(0), default=0, show_default=True, help="Seed of all draws."
)
@folder_option(
    "--out",
    help="Folder of the campaign; one that was begun is gone on with [default: campaigns/NAME].",
)
@WORKERS
@click.option(
    "--scheduler",
    metavar="ADDRESS",
    help="Hand the flights to a Dask cluster, as tcp://host:8786, instead of processes here.",
)
@click.option(
    "--timeout",
    "timeout_s",
    type=FiniteRange(0.0, min_open=True),
    metavar="S",
    help="Longest wall-clock time of a flight; its row says out_of_time then. Flights with a limit "
    "are flown one by one [default: any].",
)
@click.option(
    "--device",
    type=click.Choice(["cpu", "gpu"]),
    default="cpu",
    show_default=True,
    help="Where flights fly: gpu is an NVIDIA device, hundreds at a time, with the same rows.",
)
@flight_option("json")
def run(file: str, out: Path | None, as_json: bool, **options: Any) -> None:
    """Fly a campaign into a folder; the same command resumes an interrupted one.

    FILE is a YAML file, or a name of config/campaigns; docs/manual/campaigns.md has its format.
    The table depends only on file, seed, runs and software. Exit code 0 even if
    flights fail: the table says why. More --runs extend a campaign without fixed_runs.

    \b
    Examples:
      space-robot campaign run first --runs 200 --seed 7 --out campaigns/a
      space-robot campaign run my.yaml --runs 10000 --out campaigns/b --workers 8 --timeout 60
      space-robot campaign run my.yaml --out campaigns/b --scheduler tcp://cluster:8786
      space-robot campaign run my.yaml --runs 10000 --out campaigns/c --device gpu
    """
    from ..campaign.flown import Campaign
    from ..console.progress import rated_progress
    from ..console.terminal import echo_json, terminal
    from .campaign_display import as_record, print_summary

    folder = out or Path("campaigns") / campaign_name(Path(file))
    latest: list[Progress] = []
    try:
        with rated_progress("flights") as show:

            def show_progress(progress: Progress) -> None:
                if not latest and progress.kept:
                    said = f"{folder}: {progress.kept} of {progress.total} flights are there"
                    click.echo(f"{said}; going on", err=True)
                latest[:] = [progress]
                failed = f"{progress.failed} failed" if progress.failed else ""
                show(progress.done, progress.total, failed)

            flown = Campaign.load(file).run(
                **options,
                out=folder,
                progress=show_progress,
                warn=lambda text: click.echo(text, err=True),
            )
    except KeyboardInterrupt:
        if latest:
            done = f"{latest[0].done} of {latest[0].total} flights are kept in {folder}"
            click.echo(f"{done}: the same line goes on with the others", err=True)
        raise
    if not latest:
        click.echo(f"{folder}: all {len(flown.table)} flights are there: nothing to fly", err=True)
    if as_json:
        echo_json(as_record(flown))
    else:
        print_summary(flown, terminal())


def campaign_name(file: Path) -> str:
    """Return the name of a campaign: of its file, or of the folder of its ``campaign.yaml``."""
    in_own_folder = file.stem in ("campaign", "study")
    return file.parent.resolve().name if in_own_folder else file.stem


@campaign.command()
@FOLDER
@click.argument("file", type=click.Path(path_type=Path), metavar="FILE")
def export(folder: Path, file: Path) -> None:
    """Write the table of a campaign as Parquet or CSV, a row a flight.

    DIR is the folder of `campaign run`, finished or not; the suffix of FILE chooses the format. A
    CSV file is without the bands over time.

    \b
    Examples:
      space-robot campaign export campaigns/a a.parquet
      space-robot campaign export campaigns/a a.csv
    """
    from ..campaign.flown import FlownCampaign

    FlownCampaign.open(folder).export(file)
    click.echo(f"wrote {file}", err=True)


@campaign.command()
@FOLDER
@click.argument("run", type=click.IntRange(0), metavar="RUN")
@click.option("--law", metavar="LAW", help="As the campaign's file has it [default: its first].")
@flight_option("bag")
@click.option(
    "--trust",
    is_flag=True,
    help="Import the module:Class and read the files that the campaign names: runs its code.",
)
@flight_option("json")
def rerun(
    folder: Path, run: int, law: str | None, bag: Path | None, trust: bool, as_json: bool
) -> None:
    """Repeat the flight of a row and check that it is bit-identical.

    DIR is the campaign's folder, RUN the number of the run. Exit code 1 if the flight differs from
    the row in a single bit; it then says what may be the reason. Modules and files that the
    campaign names are not opened without --trust.

    \b
    Examples:
      space-robot campaign rerun campaigns/a 4711
      space-robot campaign rerun campaigns/a 4711 --law ctc=tuned --bag flights/4711
    """
    from space_robot_msgs_py.errors import FlightError, InputError, SpaceRobotError

    from ..campaign.flown import FlownCampaign
    from ..console.terminal import echo_json
    from ..flight.flight_messages import check_bag_path
    from .report_display import show_report

    if bag:
        check_bag_path(bag)
    try:
        flown = FlownCampaign.open(folder, trust).rerun(run, law, bag)
    except InputError:
        raise
    except SpaceRobotError as error:  # of someone's law: its row says the same
        raise FlightError(f"run {run}: {error}") from None
    if as_json:
        about = {"run": run, "law": flown.task.law, "same": flown.is_same, "digest": flown.digest}
        echo_json({**flown.report(), "campaign": about})
    elif flown.metrics:
        show_report(flown.report(), as_json)
    if not flown.is_complete:
        click.echo(flown.reason, err=True)
    click.echo(flown.verdict, err=as_json or not flown.is_same)
    if not flown.is_same:
        raise click.exceptions.Exit(1)


@campaign.command()
@FOLDER
@file_option("--html", help="One page with all tables and figures, to send to a colleague.")
@file_option(
    "--markdown", help="The tables as Markdown, and a figure of the same name as PNG and SVG."
)
@click.option(
    "--metric",
    "metrics",
    multiple=True,
    metavar="NAME",
    help="Compare the laws by this metric, as attitude.max; repeatable [default: RMS errors, "
    "the base's ripple, and what is required].",
)
@click.option(
    "--study",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="Judge by the requirements of this campaign's file [default: those that were flown].",
)
@flight_option("json")
def report(
    folder: Path,
    html: Path | None,
    markdown: Path | None,
    metrics: tuple[str, ...],
    study: Path | None,
    as_json: bool,
) -> None:
    """Report a campaign: warnings, requirements, laws, influences, worst runs.

    DIR is the folder of `campaign run`, finished or not. docs/manual/campaigns.md explains
    the numbers. Damaged files are listed.

    \b
    Examples:
      space-robot campaign report campaigns/a
      space-robot campaign report campaigns/a --html a.html
      space-robot campaign report campaigns/a --metric attitude.max --json
      space-robot campaign report campaigns/a --study stricter.yaml
    """
    from ..analysis.figures.style import save_figure
    from ..campaign.flown import FlownCampaign
    from ..campaign.report import documents
    from ..campaign.report.figures import summary_figure
    from ..campaign.report.findings import Findings
    from ..campaign.study import read_study
    from ..console.files import check_free, write_text
    from ..console.terminal import echo_json, terminal

    for path in (html, markdown):
        if path:
            check_free(path)
    judged_by = None if study is None else read_study(study)
    findings = Findings.of(FlownCampaign.open(folder), judged_by, metrics)
    for warning in findings.warnings:
        click.echo(warning, err=True)
    if html:
        write_text(documents.render(findings), html)
        click.echo(f"wrote {html}", err=True)
    if markdown:
        files = [markdown]
        if figure := summary_figure(findings):
            files += save_figure(figure, markdown.with_suffix(""))
        write_text(documents.markdown(findings), markdown)
        click.echo(f"wrote {', '.join(map(str, files))}", err=True)
    if as_json:
        echo_json(documents.record(findings))
    else:
        documents.print_report(findings, terminal())
