"""What the program of a batch writes into logs at each tick."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import ALL_FIELDS

OF_THE_LAW = ("s", "u")
"""Telemetry that is in the memory of the law in force."""
OF_SIGNALS = ("n_hat", "error")
"""That is in the controller's signals; in the log after `OF_THE_LAW`."""


class LogColumn(NamedTuple):
    """Numbers of a row."""

    name: str
    text: str
    """An array in C++."""
    width: int
    first: int
    """Place in the row."""
    before: bool = False
    """Whether they are known before the law's answer."""

    @property
    def place(self) -> slice:
        """Place in the row."""
        return slice(self.first, self.first + self.width)


def columns_of(log: FlightLog) -> list[LogColumn]:
    """Return the columns of a flight's log; the law's own are last, without a text."""
    columns: list[LogColumn] = []

    def add(name: str, text: str, width: int, before: bool = False) -> None:
        if width:
            first = sum(column.width for column in columns)
            columns.append(LogColumn(name, text, width, first, before))

    for name in ALL_FIELDS:
        add(f"truth.{name}", f"plant.truth.{name}", getattr(log, name).shape[1], True)
    for name, column in ({} if log.measured is None else log.measured.columns).items():
        add(f"measured.{name}", f"plant.measured.{name}", column.shape[1], True)
    axes = log.axes
    add("commanded_torque", "torque", 0 if log.commanded_torque is None else axes)
    add("actuator_commands", f"(&torque[{axes}])", log.actuator_commands.shape[1])
    if log.telemetry is not None:
        for name in OF_SIGNALS:
            add(f"telemetry.{name}", f"controller.signals.{name}", axes)
        for name in OF_THE_LAW:
            add(f"telemetry.{name}", "", axes)
    return columns


def parts_of(columns: list[LogColumn], log: FlightLog) -> Iterator[tuple[Array, slice]]:
    """Yield the arrays (N, c) of a log, and the places of their numbers in a row."""
    for column in columns:
        kind, _, name = column.name.partition(".")
        if kind == "telemetry":
            assert log.telemetry is not None
            yield log.telemetry[:, (*OF_THE_LAW, *OF_SIGNALS).index(name)], column.place
        else:
            owner = log.measured if kind == "measured" else log
            yield getattr(owner, name or kind), column.place
