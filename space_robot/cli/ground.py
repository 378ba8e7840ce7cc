"""The command ``space-robot ground``: telemetry on a page of NASA's Open MCT."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING

import click

from .options import excerpt_options, file_option
from .telemetry import PACKETS

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog

    from ..ground.server import GroundServer


@click.command()
@click.argument("bag", required=False, type=click.Path(path_type=Path))
@click.option(
    "--udp",
    type=click.IntRange(1, 65535),
    default=10015,
    show_default=True,
    help="Port at which telemetry is received.",
)
@file_option(
    "--database",
    help="XTCE file of the telemetry [default: that of the flight that sends to the port].",
)
@PACKETS
@click.option(
    "--port",
    type=click.IntRange(0, 65535),
    default=8090,
    show_default=True,
    help="Of the page, on 127.0.0.1; 0: a free one.",
)
@click.option("--open/--no-open", "opens", default=True, help="Open the page in a browser.")
@excerpt_options
def ground(
    bag: Path | None,
    udp: int,
    database: Path | None,
    packets: str,
    port: int,
    opens: bool,
    read: Callable[[Path], FlightLog],
) -> None:
    """Show telemetry of a flight in NASA's Open MCT: curves, limits, events.

    Without a BAG it shows what flies: start it, then a flight with --telemetry. The numbers come
    out of the packets, by their XTCE database alone, as at a ground station.

    \b
    Examples:
      space-robot ground
      space-robot fly --telemetry udp:127.0.0.1:10015 --realtime
      space-robot ground flights/one
      space-robot ground flights/one --packets fast --from 10 --to 20
    """
    import asyncio
    from tempfile import TemporaryDirectory

    from ..flight.telemetry import TelemetryPlan, check_libraries, database_path
    from ..processes.interruption import Interrupted

    check_libraries("aiohttp", "lxml", "space_packet_parser")
    from ..ground.server import GroundServer, find_openmct

    openmct = find_openmct()
    with TemporaryDirectory() as folder:
        if bag:
            database = Path(folder) / "telemetry.xml"
            server = GroundServer(openmct, database, is_live=False)
            log = read(bag)
            plan = TelemetryPlan.of_log(log, packets)
            database.write_text(plan.database, "utf-8")
            for packet in plan.packets(log):
                server.receive(packet)
        else:
            database = database or database_path(f"udp:127.0.0.1:{udp}")
            server = GroundServer(openmct, database, is_live=True)
    try:
        asyncio.run(_serve(server, port, udp, opens))
    except Interrupted:
        click.echo("ended", err=True)


async def _serve(server: GroundServer, port: int, udp: int, opens: bool) -> None:
    from ..ground.server import serve

    events = serve(server, port, udp)
    address = await anext(events)
    click.echo(f"the display is at {address}; Ctrl-C ends", err=True)
    if opens:
        webbrowser.open(address)
    async for text in events:
        click.echo(text, err=True)
