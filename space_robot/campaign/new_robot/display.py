"""Table of the flights of a new robot."""

from __future__ import annotations

from ...analysis.metrics import unit_of
from ...console.tables import Column, Table
from .make import NewRobot


def rms_table(made: NewRobot) -> Table:
    """Return the RMS of errors and torques under every law, mean over the axes."""
    flights = made.flights
    keys = dict.fromkeys(key for flown in flights.values() for key in flown.rms)
    columns = [Column(is_label=True), *(Column(law, spec=".3g") for law in flights)]
    rows = [
        [f"{key}, {unit_of(key)}", *(flown.rms.get(key, "ended") for flown in flights.values())]
        for key in keys
    ]
    seconds = made.mission.waypoint_times[-1]
    title = f"{made.robot.name}, {made.robot.n} joints, {seconds:g} s: RMS, mean of axes"
    table = Table.of(title, columns, rows)
    return Table(table.title, table.columns, table.groups, made.remarks)
