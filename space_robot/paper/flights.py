"""Flights of Table V: the rows, their variants, and the results kept of each."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from typing import Any, NamedTuple

from space_robot_control.controller.settings import DEFAULT, gain_files
from space_robot_control.navigation.settings import NavigationMode
from space_robot_msgs_py.errors import DivergedError, InputError

from ..analysis.figures import control_results
from ..analysis.figures.base_torque import BaseTorque
from ..analysis.figures.figure_set import FigureFolder
from ..analysis.measure import measure
from ..flight.plan import Flight, Scenario, resolve
from ..flight.simulate import simulate
from .table_v import COLUMNS, PRINTED, TORQUE

ROBOT = "paper"
DEFINITIONS = {"rms": "mean of the axes' RMS", "rms_eq64": "RMS by (64)"}
"""Statistics that are compared with Table V."""
CHATTER = ("variation", "chatter")
COMPARED_CASE = "1"
"""The case in which the laws are compared."""


class Variant(NamedTuple):
    """Choices that Table V leaves open: the gain set, and joint friction on or off."""

    gains: str
    friction: bool

    @property
    def title(self) -> str:
        """Text for tables and figures."""
        return f"{self.gains} gains, {'printed friction' if self.friction else 'friction-free'}"


VARIANTS = tuple(Variant(g, f) for g in ("printed", "tuned") for f in (True, False))
AS_PRINTED = VARIANTS[0]


class TableRow(NamedTuple):
    """A row of Table V."""

    controller: str
    case: str

    @classmethod
    def parse(cls, text: str) -> TableRow:
        """Parse ``CONTROLLER/CASE``.

        Raises:
            InputError: Table V has no such row.
        """
        controller, _, case = text.partition("/")
        if (controller, case) not in PRINTED:
            raise InputError(
                f"Table V has no row {text!r}: choose from {', '.join(map('/'.join, PRINTED))}"
            )
        return cls(controller, case)

    @property
    def stem(self) -> str:
        """Name of the figure's files, without suffix."""
        return f"case{self.case}_{self.controller}"

    @property
    def shown(self) -> Variant:
        """The variant that is drawn: default gains, printed friction."""
        return Variant(gain_files(ROBOT, DEFAULT)[self.controller].parent.name, True)


ROWS = tuple(TableRow(*row) for row in PRINTED)


class Equipment(NamedTuple):
    """Sensors, navigation and actuators, as options of a flight; Table V assumes ideal ones."""

    sensors: str = "ideal"
    navigation: NavigationMode = "direct"
    actuators: str = "ideal"


PERFECT = Equipment()


def plan(rows: Iterable[TableRow], brief: bool = False) -> Iterator[tuple[TableRow, Variant]]:
    """Yield the flights of ``rows``: all four variants, or (``brief``) those needed for Table V.

    These are the default gains with and without friction and, where they differ from the printed
    gains, the printed gains with the printed friction: the paper's own description.
    """
    for row in rows:
        default = row.shown.gains
        for variant in VARIANTS:
            if not brief or variant.gains == default or variant == AS_PRINTED:
                yield row, variant


class Result(NamedTuple):
    """Results of a flight."""

    row: TableRow
    variant: Variant
    parameters: dict[str, Any]
    """Settings of plant, controller and mission."""
    diverged_tick: int | None = None
    metrics: dict[str, float] | None = None
    """RMS values and chatter of the columns; None if the flight diverged."""
    base_torque: BaseTorque | None = None
    """Base torque over time, only of the shown flights of the compared case."""

    @property
    def chatters(self) -> bool:
        """Whether its chatter is judged: flown to its end, compared case, with friction."""
        is_judged = self.row.case == COMPARED_CASE and self.variant.friction
        return is_judged and self.metrics is not None


def fly(
    row: TableRow,
    variant: Variant,
    duration: float | None = None,
    figures: FigureFolder | None = None,
    equipment: Equipment = PERFECT,
) -> Result:
    """Fly one row in one variant; draw it into ``figures`` if it is `TableRow.shown`."""
    options = Scenario(
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
    flight = Flight(resolve(options))
    parameters = _parameters(flight)
    try:
        log = simulate(flight)
    except DivergedError as error:
        return Result(row, variant, parameters, error.tick)
    is_shown = variant == row.shown
    if is_shown and figures is not None:
        title = f"{row.controller}, case {row.case}: {variant.title}"
        figures.save(control_results(log, title), row.stem)
    wanted = [f"{column}.{statistic}" for statistic in DEFINITIONS for column in COLUMNS]
    wanted += [f"{column}.{statistic}" for statistic in CHATTER for column in TORQUE]
    torque = BaseTorque.of(log) if is_shown and row.case == COMPARED_CASE else None
    return Result(row, variant, parameters, None, measure(log, wanted), torque)


def _parameters(flight: Flight) -> dict[str, Any]:
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
