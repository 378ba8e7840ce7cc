"""The table of what can be plotted of a flight.

The page of `view`, its live scene, and the figures of `analyze` and of reports draw it. A new plot
is a function with `plotted` here: it is on the page then, and ``--plots`` knows its name.
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Iterator, Sequence
from contextlib import suppress
from typing import NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import one_of
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import SOURCES

from .analysed_log import ANGLES, AnalysedLog
from .errors import (
    attitude_angles,
    attitude_drift,
    relative_attitude,
    rotation_vectors,
    tracking_error,
)
from .external_torques import torques_by_source
from .measure import column_definition, column_label
from .momentum import Momentum, whole_momentum
from .series import GROUPS, SeriesGroup
from .tool_path import ToolPath, leads_tool

AXES = ("x", "y", "z")


class PlottedQuantity(NamedTuple):
    """Values with a common unit over the ticks of a flight."""

    title: str
    unit: str
    labels: Sequence[str]
    values: Array
    """(N, len(labels))."""
    wanted: Array | None = None
    """(N, len(labels)) desired values; None: there are none."""
    limits: Sequence[float] = ()
    """Largest sizes that are allowed; 0 is none."""
    is_error: bool = False
    """Zero is wanted: of several flights it is drawn on a logarithmic scale."""
    are_pulses: bool = False
    """True for duty cycles per tick, from 0 to 1."""
    is_shown: bool = True
    """False if the page has it only where it is chosen."""
    is_drawn: bool = True
    """False if the figure of its kind leaves it out."""

    @property
    def label(self) -> str:
        """Title and unit."""
        return f"{self.title} ({self.unit})" if self.unit else self.title

    @property
    def size(self) -> Array:
        """(N,) norm at each tick."""
        return np.asarray(np.linalg.norm(self.values, axis=1))


Quantities = Iterator[PlottedQuantity]
Plotter = Callable[[AnalysedLog], Quantities]


class PlotKind(NamedTuple):
    """Quantities that are chosen together."""

    text: str
    quantities: Plotter
    figure: str
    """File name of its figure of one flight; empty: there is none."""
    caption: str
    """Of the figure."""


KINDS: dict[str, PlotKind] = {}
"""By the name that chooses it, in the order of the page."""


def plotted(
    name: str, text: str, figure: str = "", caption: str = ""
) -> Callable[[Plotter], Plotter]:
    """Register a function from a flight to quantities; one that the flight lacks raises InputError.

    ``name`` chooses them, ``text`` is for the help, the others are as in `PlotKind`.
    """

    def register(function: Plotter) -> Plotter:
        KINDS[name] = PlotKind(text, function, figure, caption)
        return function

    return register


def flown_quantities(
    flight: AnalysedLog, kinds: Collection[str] = ()
) -> Iterator[tuple[str, PlottedQuantity]]:
    """Yield the kind and the quantity of all that a flight has, or of some ``kinds``."""
    for name, kind in KINDS.items():
        if not kinds or name in kinds:
            with suppress(InputError):  # what it depends on is not described
                for quantity in kind.quantities(flight):
                    yield name, quantity


def parse_kinds(text: str) -> tuple[str, ...]:
    """Return the names in a list such as ``attitude,wheels``."""
    names = tuple(dict.fromkeys(name.strip() for name in text.split(",") if name.strip()))
    if not names:
        raise InputError(f"--plots: choose of {', '.join(KINDS)}")
    for name in names:
        one_of(name, KINDS, "plot", " for --plots")
    return names


@plotted("attitude", "error of the base's attitude, or its drift")
def _attitude(flight: AnalysedLog) -> Quantities:
    log = flight.log
    if flight.controls_base:
        yield PlottedQuantity("attitude error", "deg", AXES, attitude_angles(log), is_error=True)
    else:
        angles = np.degrees(attitude_drift(log, log.quaternion[_first_known(log)]))
        yield PlottedQuantity("attitude drift", "deg", AXES, angles)


@plotted("joints", "errors of the joints")
def _joints(flight: AnalysedLog) -> Quantities:
    error = tracking_error(flight.log)
    for name, axes in flight.error_columns.items():
        if name != "attitude":
            title, labels = f"{column_label(name)} error", _names(flight, axes)
            unit = column_definition(name).unit
            yield PlottedQuantity(title, unit, labels, error[:, axes], is_error=True)


@plotted("pointing", "the base's pointing error: half cone, about the axis that points, in all")
def _pointing(flight: AnalysedLog) -> Quantities:
    if flight.controls_base:
        yield from _series(flight, "errors", ANGLES, (3600.0 * flight.budget.band_deg,))


@plotted("tool", "distance of the tool from its path, and errors of its pose")
def _tool(flight: AnalysedLog) -> Quantities:
    log = flight.log
    if leads_tool(log):
        with suppress(InputError):  # the bag does not tell what the flight software assumed
            distance = ToolPath(log).errors(0, log.ticks)[:, :1]
            yield PlottedQuantity("tool error", "m", ["distance"], distance, is_error=True)
    yield from _series(flight, "end_effector", ("boresight", "tool_attitude", "tool_position"))


@plotted("base", "drift of the base's position")
def _base(flight: AnalysedLog) -> Quantities:
    log = flight.log
    drift = log.base_position - log.base_position[_first_known(log)]
    yield PlottedQuantity("base drift", "m", AXES, drift)


@plotted("rates", "angular velocity of the base")
def _rates(flight: AnalysedLog) -> Quantities:
    yield PlottedQuantity("base rate", "rad/s", AXES, flight.log.omega_base, is_shown=False)


@plotted("positions", "positions of the joints")
def _positions(flight: AnalysedLog) -> Quantities:
    values, wanted = flight.log.joint_positions, flight.log.reference_joints[:, 0]
    yield from _by_unit(flight, "joint positions", values, ("deg", "m"), wanted=wanted)


@plotted("velocities", "velocities of the joints")
def _velocities(flight: AnalysedLog) -> Quantities:
    values, wanted = flight.log.joint_velocities, flight.log.reference_joints[:, 1]
    yield from _by_unit(flight, "joint velocities", values, ("rad/s", "m/s"), wanted=wanted)


@plotted(
    "deflection",
    "passive joints, and motors behind gears",
    "deflections",
    "Deflection of passive joints, and of joints with gears",
)
def _deflection(flight: AnalysedLog) -> Quantities:
    log, robot = flight.log, flight.robot
    away = log.passive_positions - [spring.rest for spring in robot.springs]
    yield from _by_unit(flight, "deflection", away, names=log.passive_names, is_shown=True)
    gears = dict(zip(robot.joint_names, robot.gears or (None,) * robot.n, strict=True))
    # what a motor's encoder measured is the motor's position, not the joint's
    known = [
        name
        for name in log.joint_names
        if name in log.geared_names
        and (log.measured is not None or ((gear := gears[name]) and gear.encoder != "motor"))
    ]
    joints = [log.joint_names.index(name) for name in known]
    motors = [log.geared_names.index(name) for name in known]
    away = log.motor_positions[:, motors] - log.joint_positions[:, joints]
    yield from _by_unit(flight, "gear deflection", away, names=known, is_shown=True)


@plotted("torques", "torques on base and joints")
def _torques(flight: AnalysedLog) -> Quantities:
    for name, axes in flight.torque_columns.items():
        title, labels = column_label(name), _names(flight, axes)
        values = flight.log.applied_torque[:, axes]
        yield PlottedQuantity(title, column_definition(name).unit, labels, values)


@plotted(
    "wheels",
    "momentum, torque and speed of the wheels",
    "wheels",
    "Momentum and torque of the wheels, between their limits",
)
def _wheels(flight: AnalysedLog) -> Quantities:
    log = flight.log
    if not log.wheel_velocities.shape[1]:
        return
    names, is_described = flight.parts("wheel"), False
    torques: Sequence[float] = ()
    with suppress(InputError):
        wheels = flight.actuators.wheels
        is_described = True
        momenta, torques = (wheels.values(f"max_{k}").tolist() for k in ("momentum", "torque"))
        spin = wheels.spin_momenta(log.wheel_velocities)
        yield PlottedQuantity("wheel momentum", "N m s", names, spin, limits=momenta)
    speed = PlottedQuantity("wheel speed", "rad/s", names, log.wheel_velocities)
    yield speed._replace(is_shown=not is_described, is_drawn=not is_described)
    yield PlottedQuantity(
        "wheel torque", "N m", names, log.wheel_torques, limits=torques, is_shown=False
    )


@plotted(
    "thrusters",
    "pulses of the thrusters, propellant, displacement of the robot",
    "thrusters",
    "Pulses and propellant of the thrusters, and how far the robot was pushed",
)
def _thrusters(flight: AnalysedLog) -> Quantities:
    log = flight.log
    if not (count := log.thrusts.shape[1]):
        return
    names = [f"thruster_{k + 1}" for k in range(count)]
    try:
        thrusters = flight.actuators.thrusters
    except InputError:
        largest = np.nanmax(np.abs(log.thrusts), axis=0, initial=0.0)
        shares = log.thrusts / np.where(largest > 0.0, largest, 1.0)
        yield PlottedQuantity("thruster pulses", "", names, shares, are_pulses=True)
        return
    shares = log.thrusts / thrusters.values("force")
    yield PlottedQuantity("thruster pulses", "", names, shares, are_pulses=True)
    flow = np.nan_to_num(shares * thrusters.mass_flow).sum(axis=1)
    used = 1e3 * log.timebase.period * np.cumsum(flow)[:, np.newaxis]
    yield PlottedQuantity("propellant", "g", ["used"], used, is_shown=False)
    centre = whole_momentum(log).centre_of_mass
    yield PlottedQuantity("robot pushed", "m", AXES, centre - centre[0], is_shown=False)


@plotted(
    "momentum",
    "angular momentum of the robot, of its parts and from outside",
    "momentum",
    "Angular momentum about the common centre of mass",
)
def _momentum(flight: AnalysedLog) -> Quantities:
    is_drawn = bool(flight.log.flight.get("base_actuators"))
    for title, values in _parts(whole_momentum(flight.log), flight):
        yield PlottedQuantity(title, "N m s", AXES, values, is_shown=False, is_drawn=is_drawn)


def _parts(momentum: Momentum, flight: AnalysedLog) -> Iterator[tuple[str, Array]]:
    yield "angular momentum", momentum.total
    if flight.log.wheel_velocities.shape[1]:
        yield "robot momentum", momentum.robot
        yield "momentum of all wheels", momentum.wheels
    else:
        yield "base momentum", momentum.base
        yield "arm momentum", momentum.robot - momentum.base
    if np.any(momentum.outside):
        yield "external momentum", momentum.outside


@plotted("estimates", "errors of the measured state")
def _estimates(flight: AnalysedLog) -> Quantities:
    log, measured = flight.log, flight.log.measured
    if measured is None:
        return
    turned = np.degrees(rotation_vectors(relative_attitude(log.quaternion, measured.quaternion)))
    title = "measured less true"
    yield PlottedQuantity(f"{title} attitude", "deg", AXES, turned, is_shown=False)
    rate = measured.omega_base - log.omega_base
    yield PlottedQuantity(f"{title} rate", "rad/s", AXES, rate, is_shown=False)
    away = measured.joint_positions - log.joint_positions
    yield from _by_unit(flight, f"{title} joints", away)


@plotted(
    "orbit",
    "torques from outside and the magnetic field",
    "torques_from_outside",
    "Torques from outside about the common centre of mass",
)
def _orbit(flight: AnalysedLog) -> Quantities:
    log = flight.log
    if not log.external_torques.shape[1]:
        return
    try:
        torques = {name: torque(0, log.ticks) for name, torque in torques_by_source(log).items()}
    except InputError:
        torques = dict(zip(SOURCES, np.split(log.external_torques, len(SOURCES), 1), strict=True))
    for name, torque in torques.items():
        if np.nan_to_num(torque).any():
            yield PlottedQuantity(f"{column_label(name)} torque", "N m", AXES, torque)
    if np.nan_to_num(log.magnetic_field).any():
        yield PlottedQuantity("magnetic field", "T", AXES, log.magnetic_field, is_drawn=False)


def _first_known(log: FlightLog) -> int:
    return int(np.argmax(log.finite(("base_position", "quaternion"))))


def _names(flight: AnalysedLog, axes: slice | list[int]) -> list[str]:
    names: list[str] = np.array([*AXES, *flight.log.joint_names])[axes].tolist()
    return names


def _series(
    flight: AnalysedLog, group: str, columns: Sequence[str], limits: Sequence[float] = ()
) -> Quantities:
    """Yield columns of a registered series, one number at each tick."""
    series = GROUPS[group]
    assert isinstance(series, SeriesGroup)
    blocks = [sizes for _, sizes in series.sizes(flight)]
    for column in columns:
        values = np.concatenate([sizes[column] for sizes in blocks])[:, np.newaxis]
        title, unit = f"{column_label(column)} error", column_definition(column).unit
        yield PlottedQuantity(
            title, unit, ["size"], values, limits=limits, is_error=True, is_shown=False
        )


def _by_unit(
    flight: AnalysedLog,
    title: str,
    values: Array,
    units: tuple[str, str] = ("rad", "m"),
    names: Sequence[str] | None = None,
    wanted: Array | None = None,
    is_shown: bool = False,
) -> Quantities:
    """Yield values of joints, those of revolute ones apart from those of prismatic ones."""
    names = flight.log.joint_names if names is None else names
    sliding = flight.log.flight.get("prismatic_joints", ())
    for unit, is_prismatic in zip(units, (False, True), strict=True):
        chosen = [k for k, name in enumerate(names) if (name in sliding) == is_prismatic]
        if chosen:
            factor = np.degrees(1.0) if unit == "deg" else 1.0
            desired = None if wanted is None else factor * wanted[:, chosen]
            labels = [names[k] for k in chosen]
            yield PlottedQuantity(
                title, unit, labels, factor * values[:, chosen], desired, is_shown=is_shown
            )
