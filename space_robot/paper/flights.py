"""Table V as printed, and flights of it: the rows, their variants, and the results kept of each."""

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

ROBOT = "paper"
DEFINITIONS = {"rms": "mean of the axes' RMS", "rms_eq64": "RMS by (64)"}
"""Statistics that are compared with Table V."""
CHATTER = ("variation", "chatter")
COMPARED_CASE = "1"
"""The case in which the laws are compared."""
HEADINGS = {
    "attitude": ("attitude", ""),
    "joints_1_3": ("joints 1-3", "rad"),
    "joints_4_6": ("joints 4-6", "rad"),
    "base_torque": ("base torque", "N m"),
    "torque_1_3": ("torque 1-3", "N m"),
    "torque_4_6": ("torque 4-6", "N m"),
}
"""Name and unit of each column, by its name in `space_robot.analysis.analyze`."""
COLUMNS = tuple(HEADINGS)
TRACKING, TORQUE = COLUMNS[:3], COLUMNS[3:]
PRINTED: dict[tuple[str, str], tuple[float, ...]] = {
    ("ctc", "1"): (2.5642e-4, 0.0107, 0.0227, 0.8772, 0.9896, 0.0454),
    ("ctc", "2"): (2.5922e-4, 0.0107, 0.0227, 0.8773, 0.9897, 0.0454),
    ("ctc", "3"): (3.2715e-4, 0.0137, 0.0281, 1.0617, 1.1713, 0.0606),
    ("ctc_smc", "1"): (0.0037, 0.0055, 3.3158e-4, 0.9062, 1.0030, 0.0470),
    ("ctc_smc", "2"): (0.0073, 0.1139, 0.0511, 0.9622, 1.0373, 0.0470),
    ("ctc_smc", "3"): (0.0070, 0.1697, 0.1143, 1.1600, 1.2310, 0.0639),
    ("tde_smc", "1"): (6.2914e-4, 8.5157e-5, 1.2593e-4, 0.8328, 0.9461, 0.0489),
    ("tde_smc", "2"): (7.3128e-4, 8.4997e-5, 1.2709e-4, 0.8318, 0.9468, 0.0490),
    ("tde_smc", "3"): (7.2389e-4, 8.5018e-5, 1.3153e-4, 0.9924, 1.1092, 0.0628),
    ("tde_tsmc", "1"): (1.3647e-4, 2.5458e-5, 7.7319e-5, 0.7991, 0.9296, 0.0451),
    ("tde_tsmc", "2"): (1.5397e-4, 2.5458e-5, 7.7319e-5, 0.8003, 0.9305, 0.0451),
    ("tde_tsmc", "3"): (1.5253e-4, 2.5458e-5, 7.7314e-5, 0.9635, 1.0938, 0.0600),
    ("tde_stc", "1"): (6.2950e-4, 8.4955e-5, 1.2742e-4, 0.7988, 0.9285, 0.0450),
    ("tde_stc", "2"): (7.3142e-4, 8.4956e-5, 1.2742e-4, 0.8027, 0.9313, 0.0451),
    ("tde_stc", "3"): (7.2380e-4, 8.4959e-5, 1.2742e-4, 0.9665, 1.0952, 0.0601),
    ("tde_stc", "4-1"): (7.0756e-4, 8.4966e-5, 1.2742e-4, 1.1328, 1.2610, 0.0749),
    ("tde_stc", "4-2"): (6.9310e-4, 8.4968e-5, 1.2741e-4, 1.3002, 1.4276, 0.0889),
}
"""Values by controller and case: mean of the axes' RMS values, which is not (64)."""


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
            rows = ", ".join(map("/".join, PRINTED))
            raise InputError(f"Table V has no row {text!r}: choose from {rows}")
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
    def chatter(self) -> dict[str, dict[str, float]]:
        """Statistics of the torques' chatter by column, of the compared case with friction.

        The total variation per time, N m/s, and the share of the power above 100 Hz, both the
        mean of the axes; empty for other flights, and those that diverged.
        """
        if self.metrics is None or self.row.case != COMPARED_CASE or not self.variant.friction:
            return {}
        return {key: {c: self.metrics[f"{c}.{key}"] for c in TORQUE} for key in CHATTER}


def fly(
    planned: tuple[TableRow, Variant],
    duration: float | None = None,
    figures: FigureFolder | None = None,
    equipment: Equipment = PERFECT,
) -> Result:
    """Fly one row in one variant; draw it into ``figures`` if it is `TableRow.shown`."""
    row, variant = planned
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
    navigation, mission = flight.controller_settings.filter_settings, flight.mission_settings
    parameters = {
        "period_s": flight.period,
        "navigation": navigation.model_dump() if navigation else "direct",
        "plant": flight.plant_settings.model_dump(exclude={"mission", "wait_for"}),
        "gains": flight.scenario.gains_used,
        "mission": {"start_deg": mission.joints_deg, "segments": mission.segments},
    }
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
