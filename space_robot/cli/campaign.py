"""The command ``space-robot campaign``: run many flights, repeat one, report."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from .campaign_report import report
from .completed_names import names_in
from .numbers import FiniteRange
from .options import folder_option

if TYPE_CHECKING:
    from ..campaign.flown.flights import Progress

SECTION = "Gains and studies"


@click.group()
def campaign() -> None:
    """Fly thousands of dispersed flights and test requirements with confidence.

    \b
    Examples:
      space-robot campaign run first --runs 200 --seed 7 --out campaigns/a
      space-robot campaign rerun campaigns/a 47 --bag flights/47
      space-robot campaign report campaigns/a --html a.html
    """


campaign.add_command(report)


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
@click.option(
    "--workers",
    type=click.IntRange(0, 1024),
    help="Processes that fly; 0: this one alone [default: one a core].",
)
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
@click.option("--json", "as_json", is_flag=True, help="Print outcomes and verdicts as JSON.")
def run(
    file: str,
    runs: int | None,
    seed: int,
    out: Path | None,
    workers: int | None,
    scheduler: str | None,
    timeout_s: float | None,
    as_json: bool,
) -> None:
    """Fly a campaign into a folder; the same command resumes an interrupted one.

    FILE is a YAML file, or a name of config/campaigns; docs/manual/campaigns.md has its format.
    The table depends only on file, seed, runs and software. Exit code 0 even if
    flights fail: the table says why. More --runs extend a campaign without fixed_runs.

    \b
    Examples:
      space-robot campaign run first --runs 200 --seed 7 --out campaigns/a
      space-robot campaign run my.yaml --runs 10000 --out campaigns/b --workers 8 --timeout 60
      space-robot campaign run my.yaml --out campaigns/b --scheduler tcp://cluster:8786
    """
    from ..campaign.flown import Campaign
    from ..console.progress import rated_progress
    from ..console.terminal import echo_json, terminal
    from .campaign_display import as_record, print_summary

    folder = out or Path("campaigns") / name_of(Path(file))
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
                runs,
                seed,
                folder,
                workers,
                scheduler,
                timeout_s,
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


def name_of(file: Path) -> str:
    """Return the name of a campaign: of its file, or of the folder of its ``campaign.yaml``."""
    in_own_folder = file.stem in ("campaign", "study")
    return file.parent.resolve().name if in_own_folder else file.stem


@campaign.command()
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
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
@click.argument("folder", type=click.Path(path_type=Path), metavar="DIR")
@click.argument("run", type=click.IntRange(0), metavar="RUN")
@click.option("--law", metavar="LAW", help="As the campaign's file has it [default: its first].")
@click.option("--bag", type=click.Path(path_type=Path), help="Folder of the bag to write.")
@click.option(
    "--trust",
    is_flag=True,
    help="Import the module:Class and read the files that the campaign names: runs its code.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
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
