"""Table of the flights of a new robot."""

from __future__ import annotations

from ...analysis.measure import column_unit, describe
from ...analysis.report_tables import short_name
from ...console.tables import Column, Table
from .make import NewRobot


def rms_table(made: NewRobot) -> Table:
    """Return the RMS of errors and torques under every law, mean over the axes."""
    flights = made.flights
    of_laws = {law: flown.rms for law, flown in flights.items()}
    every = dict.fromkeys(key for rms in of_laws.values() for key in rms)
    keys = [key for key in every if describe(f"{key}.rms").is_shown]
    columns = [
        Column("law", is_label=True),
        *(Column(short_name(k), column_unit(k), ".3g") for k in keys),
    ]
    rows = [[law, *(rms.get(k, "ended") for k in keys)] for law, rms in of_laws.items()]
    seconds = made.duration
    title = f"{made.robot.name}, {made.robot.n} joints, {seconds:g} s: RMS, mean of axes"
    table = Table.of(title, columns, rows)
    return Table(table.title, table.columns, table.groups, made.remarks)
