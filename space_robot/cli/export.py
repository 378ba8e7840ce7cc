"""The command ``space-robot export``: flight software as C99 that computes the same bits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from ..console.tables import Column, JudgedCell, Table, named
from .option_types import names_in
from .options import flight_options, plan_flight

if TYPE_CHECKING:
    from ..export.folder import ReplayVerdict


@click.command()
@flight_options(
    *("controller", "robot", "gains", "mission", "case", "sensors", "plant_robot", "actuators"),
    *("orbit", "navigation", "duration", "period", "swaps", "faults", "seed", "set"),
    *("scenario", "json"),
)
@click.option(
    "--law",
    "laws",
    multiple=True,
    metavar="LAW",
    help="A further law of the gain set, for space_robot_choose_law(); may be repeated.",
)
@click.option(
    "-o",
    "--out",
    type=click.Path(path_type=Path),
    default=Path("flight_code"),
    show_default=True,
    help="Folder to write.",
)
@click.option("--force", is_flag=True, help="Replace the folder if it exists.")
@click.option(
    "--verify", "is_verified", is_flag=True, help="Build and replay with all compilers here."
)
@click.option(
    "--requirements",
    metavar="FILE",
    shell_complete=names_in("requirements"),
    help="Name in the header the requirements of this file allocated to flight_software.",
)
@click.option(
    "--framework",
    type=click.Choice(["fprime", "cfs"]),
    help="Also write a component for F' or an application for cFS.",
)
@click.option(
    "--acceptance-seconds",
    type=click.FloatRange(min=0.01),
    metavar="S",
    help="Seconds of the scenario to record [default: all of it].",
)
def export(
    as_json: bool,
    laws: tuple[str, ...],
    out: Path,
    force: bool,
    is_verified: bool,
    requirements: str | None,
    framework: str | None,
    acceptance_seconds: float | None,
    **options: Any,
) -> None:
    """Export the flight software of a scenario as C99 that computes the same bits.

    The folder has the supervisor, the laws with their swaps, the estimate, navigation and
    allocation, as functions of C with their gains and the robot's masses, and recorded flights.
    `make` in it replays them: every command must be equal to the bit. Nothing of it allocates
    memory, and it calls no function of the C library that may differ between machines.

    \b
    Examples:
      space-robot export -o flight_code --verify
      space-robot export --controller tde_stc --swap 5:ctc --navigation filtered --sensors fine
      space-robot export --robot seven_joint --actuators wheels --law tde_smc --law ctc
      space-robot export --scenario mine.yaml --force
      space-robot export --framework fprime --law ctc --verify
    """
    from space_robot_msgs_py.config.validation import validate
    from space_robot_msgs_py.errors import FlightError

    from ..console.progress import counting_progress
    from ..console.terminal import echo_json
    from ..export.folder import check_folder, framework_checks, verify, write_folder, write_readme
    from ..export.software import export as export_software
    from ..export.software import recorded_flights
    from ..flight.compilation import compile_kernels
    from ..scenario.scenario import Scenario
    from ..trace.requirements import read_requirements

    check_folder(out, force)
    every = read_requirements(requirements).requirements if requirements else {}
    allocated = [f"{id_}: {r.text}" for id_, r in every.items() if r.allocated_to]
    flight = plan_flight(**options)
    flight.check_in_process()
    exported = export_software(flight, laws, allocated)
    compile_kernels(bool(flight.plant.names.actuators))
    plan = validate(Scenario, options, "options")
    flights = recorded_flights(plan, exported, laws, acceptance_seconds)
    with counting_progress("recorded flights") as begin:
        advance = begin(len(exported.software.laws) + 2)
        written = write_folder(out, exported, flights, advance, framework)
    verdicts = list(verify(out)) if is_verified else []
    checks = framework_checks(out) if is_verified else ()
    unverified = {name: missing for name, _, missing in checks if missing}
    if verdicts:
        write_readme(out, exported, written, verdicts)
    if as_json:
        echo_json(
            {
                "folder": str(out),
                "digest": exported.digest,
                **exported.figures(),
                "flights": [{"name": n, "about": a, "records": count} for n, a, count in written],
                "verified": [verdict._asdict() for verdict in verdicts],
                "unverified": unverified,
            }
        )
    else:
        _print_export(out, exported.figures(), written)
        _print_verdicts(verdicts, unverified)
    if wrong := [v for v in verdicts if not v.is_accepted]:
        raise FlightError("; ".join(f"{v.target}: {v.reason}" for v in wrong))


def _print_export(
    folder: Path, figures: Mapping[str, Any], flights: Sequence[tuple[str, str, int]]
) -> None:
    from ..console.terminal import print_table, say, terminal

    console = terminal()
    say(
        console,
        f"{folder}: laws {', '.join(figures['laws'])}; {figures['functions']} kernels, "
        f"{figures['lines']} lines of C99, {figures['state_bytes']} bytes of state",
    )
    columns = named("flight"), named("what"), Column("states", spec="d")
    print_table(Table.of("Recorded flights", columns, flights), console)
    say(console, f"replay them: make -C {folder}")


def _print_verdicts(verdicts: Sequence[ReplayVerdict], unverified: Mapping[str, str]) -> None:
    from ..console.terminal import print_table, say, terminal

    if not verdicts:
        return
    columns = named("target"), Column("states", spec="d"), Column("tick", "ns", ".0f")
    rows = [
        [v.target, v.states, v.tick_ns, JudgedCell.of(v.is_accepted, v.text, v.text)]
        for v in verdicts
    ]
    console = terminal()
    print_table(Table.of("Acceptance", [*columns, named("verdict")], rows), console)
    for name, missing in unverified.items():
        say(console, f"{name}: not verified, {missing}")
