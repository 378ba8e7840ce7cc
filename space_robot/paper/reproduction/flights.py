"""Flights of Table V: the rows, their variants, and the results kept of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

from space_robot_control.controller.settings import DEFAULT, gain_files
from space_robot_control.navigation.settings import NavigationMode
from space_robot_msgs_py.errors import DivergedError, InputError

from ...analysis.figures import control_results
from ...analysis.figures.figure_set import FigureFolder
from ...analysis.figures.flight_curves import BaseTorque
from ...analysis.measure import measure
from ...flight.plan import Flight, Scenario, resolve
from ...flight.simulate import simulate
from .table_v import COLUMNS, PRINTED, TORQUE

ROBOT = "paper"
DEFINITIONS = {"rms": "mean of the axes' RMS", "rms_eq64": "RMS by (64)"}
"""Statistics that are compared with Table V."""
CHATTER = ("variation", "chatter")
COMPARED_CASE = "1"
"""The case in which the laws are compared."""


@dataclass(frozen=True)
class Variant:
    """Choices that Table V leaves open: the gain set, and joint friction on or off."""

    gains: str
    friction: bool

    @property
    def title(self) -> str:
        """Text for tables and figures."""
        return f"{self.gains} gains, {'printed friction' if self.friction else 'friction-free'}"


VARIANTS = tuple(Variant(g, f) for g in ("printed", "tuned") for f in (True, False))
AS_PRINTED = VARIANTS[0]


@dataclass(frozen=True)
class TableRow:
    """A row of Table V."""

    controller: str
    case: str

    @classmethod
    def parse(cls, text: str) -> TableRow:
        """Parse ``CONTROLLER/CASE``.

        Raises:
            InputError: Table V has no such row.
        """
        row = cls(*text.partition("/")[::2])
        if (row.controller, row.case) not in PRINTED:
            names = ", ".join(f"{controller}/{case}" for controller, case in PRINTED)
            raise InputError(f"Table V has no row {text!r}: choose from {names}")
        return row

    @property
    def stem(self) -> str:
        """Name of the figure's files, without suffix."""
        return f"case{self.case}_{self.controller}"

    @property
    def shown(self) -> Variant:
        """The variant that is drawn: default gains, printed friction."""
        return Variant(gain_files(ROBOT, DEFAULT)[self.controller].parent.name, True)


ROWS = tuple(TableRow(controller, case) for controller, case in PRINTED)


class Equipment(NamedTuple):
    """Sensors, navigation and actuators; Table V assumes ideal ones."""

    sensors: str = "ideal"
    """Name of a file in config/sensors, or a path."""
    navigation: NavigationMode = "direct"
    actuators: str = "ideal"
    """Name of a file in config/actuators, or a path."""


PERFECT = Equipment()


class Planned(NamedTuple):
    """A row in one variant."""

    row: TableRow
    variant: Variant
    shown: bool
    """True if it is drawn: default gains, printed friction."""

    @property
    def compared(self) -> bool:
        """True for the flight that represents its law in the comparison figures."""
        return self.shown and self.row.case == COMPARED_CASE


def plan(rows: Iterable[TableRow], brief: bool = False) -> Iterator[Planned]:
    """Yield the flights of ``rows``: all four variants, or (``brief``) those needed for Table V.

    These are the default gains with and without friction and, where they differ from the printed
    gains, the printed gains with the printed friction: the paper's own description.
    """
    for row in rows:
        shown = row.shown
        for variant in VARIANTS:
            if not brief or variant.gains == shown.gains or variant == AS_PRINTED:
                yield Planned(row, variant, variant == shown)


@dataclass(frozen=True)
class Result:
    """Results of a flight."""

    row: TableRow
    variant: Variant
    parameters: dict[str, Any]
    """Settings of plant, controller and mission."""
    diverged_tick: int | None = None
    metrics: dict[str, float] | None = None
    """RMS values and chatter of the columns; None if the flight diverged."""
    base_torque: BaseTorque | None = None
    """Base torque over time, only of compared flights."""

    @property
    def chatters(self) -> bool:
        """Whether its chatter is judged: flown to its end, compared case, with friction."""
        is_judged = self.row.case == COMPARED_CASE and self.variant.friction
        return is_judged and self.metrics is not None


def fly(
    planned: Planned,
    duration: float | None,
    figures: FigureFolder | None,
    equipment: Equipment = PERFECT,
) -> Result:
    """Fly one row in one variant; draw it into ``figures`` if it is a shown one."""
    row, variant, _ = planned
    flight = Flight(
        resolve(
            Scenario(
                controller=row.controller,
                case=row.case,
                gains=variant.gains,
                robot=ROBOT,
                friction=variant.friction,
                duration=duration,
                sensors=equipment.sensors,
                actuators=equipment.actuators,
                navigation=None if equipment.navigation == "direct" else equipment.navigation,
            )
        )
    )
    flown = parameters(flight)
    try:
        log = simulate(flight)
    except DivergedError as error:
        return Result(row, variant, flown, error.tick)
    if planned.shown and figures is not None:
        title = f"{row.controller}, case {row.case}: {variant.title}"
        figures.save(control_results(log, title), row.stem)
    wanted = [f"{column}.{statistic}" for statistic in DEFINITIONS for column in COLUMNS]
    wanted += [f"{column}.{statistic}" for statistic in CHATTER for column in TORQUE]
    return Result(
        row,
        variant,
        flown,
        None,
        measure(log, wanted),
        BaseTorque.of(log) if planned.compared else None,
    )


def parameters(flight: Flight) -> dict[str, Any]:
    """Return the settings of plant, controller and mission in a flight."""
    navigation = flight.controller_settings.filter_settings
    return {
        "period_s": flight.period,
        "navigation": navigation.model_dump() if navigation else "direct",
        "plant": flight.plant_settings.model_dump(exclude={"mission", "wait_for"}),
        "gains": flight.scenario.gains_used,
        "mission": {
            "start_deg": flight.mission_settings.joints_deg,
            "segments": flight.mission_settings.segments,
        },
    }
