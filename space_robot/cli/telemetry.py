"""The command ``space-robot telemetry``: packets of a recorded flight, and their database."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .option_types import names_in
from .options import excerpt_options

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog


def _list_signals(context: click.Context, option: click.Parameter, is_asked: bool) -> None:
    if not is_asked or context.resilient_parsing:
        return
    from space_robot_msgs_py.telemetry.structures import TELEMETERED

    from ..console.tables import Table, named
    from ..console.terminal import print_table, terminal

    rows = [[name, each.unit, each.text] for name, each in TELEMETERED.items()]
    columns = [named("signal"), named("unit"), named("what")]
    print_table(Table.of("Signals of telemetry", columns, rows), terminal())
    context.exit()


PACKETS = click.option(
    "--packets",
    default="housekeeping",
    show_default=True,
    metavar="NAME-or-FILE",
    shell_complete=names_in("telemetry", ["housekeeping"]),
    help="What the packets of a BAG have: a name of config/telemetry, or a path to a YAML file.",
)


@click.command()
@click.argument("bag", type=click.Path(path_type=Path))
@click.option(
    "-o",
    "--out",
    default="",
    metavar="DESTINATION",
    help="A file, or udp:HOST:PORT [default: <BAG>.packets, here].",
)
@PACKETS
@click.option(
    "--signals",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_list_signals,
    help="List the signals that packets may have.",
)
@excerpt_options
@click.option("--json", "as_json", is_flag=True, help="Print the report as JSON.")
def telemetry(
    bag: Path, out: str, packets: str, read: Callable[[Path], FlightLog], as_json: bool
) -> None:
    """Write a recorded flight as telemetry packets, with their XTCE database.

    The packets are CCSDS space packets with headers of ECSS PUS-C, as `fly` and `simulate` send
    them with --telemetry: housekeeping (service 3) and events (service 5), stamped with simulated
    time. The database, beside the file with the suffix .xml, is read by Yamcs, OpenMCT and other
    ground software.

    \b
    Examples:
      space-robot telemetry flights/one
      space-robot telemetry flights/one --packets fast -o one.packets --from 2 --to 5
      space-robot telemetry flights/one -o udp:127.0.0.1:10015
      space-robot simulate --telemetry live.packets
      space-robot telemetry --signals
    """
    from space_robot_msgs_py.telemetry.downlink import open_sink

    from ..console.files import atomic_file, write_text
    from ..console.terminal import echo_json
    from ..flight.telemetry import TelemetryPlan, database_path

    destination = out or f"{bag.resolve().name}.packets"
    log = read(bag)
    plan = TelemetryPlan.of_log(log, packets)
    database, path = plan.database, database_path(destination)
    written = [*plan.packets(log)]
    if destination.startswith("udp:"):
        open_sink(destination).writelines(written)
    else:
        with atomic_file(Path(destination), replace=True) as file:
            file.writelines(written)
    write_text(database, path, replace=True)
    report = {"packets": len(written), "destination": destination, "database": str(path)}
    if as_json:
        echo_json(report)
    else:
        click.echo(f"{destination}: {len(written)} packets; database: {path}")
