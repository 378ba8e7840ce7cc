"""Figures of hardware and surroundings in one flight: momentum, actuators, gears, an orbit."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import (
    BaseActuatorSettings,
    ThrusterSettings,
    WheelSettings,
)
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..actuation import deflection
from ..errors import attitude_angles, relative_rate
from ..momentum import Momentum
from .single_flight import BASE_AXES
from .style import GREY, LineStyle, house_style, legend_above, page, plot_lines

Array = NDArray[np.float64]

BINS = 600
"""Columns of the raster of pulses; brightness shows the duty cycle of a thruster."""
POINTS = 6000
"""Maximum number of points of a line in the phase plane."""
INERTIAL = ("x", "y", "z")


@house_style()
def momentum(log: FlightLog, budget: Momentum, flown: BaseActuatorSettings) -> Figure:
    """Draw the angular momentum of robot, wheels and both, by inertial axis.

    External momentum is drawn, too; without it the sum is constant. Without base actuators the
    momenta of base, arm and both are drawn.
    """
    parts = {"robot": budget.robot, "wheels": budget.wheels, "sum": budget.total}
    if not flown.wheel_count:
        arm = budget.robot - budget.base
        parts = {"base": budget.base, "arm": arm, "sum": budget.total}
    if np.any(budget.outside):
        parts["from outside"] = budget.outside
    figure = page(18.0 + 45.0 * 3)
    panels = figure.subplots(3, 1, sharex=True)
    for i, (axes, name) in enumerate(zip(panels, INERTIAL, strict=True)):
        lines = np.column_stack([values[:, i] for values in parts.values()])
        plot_lines(axes, log.time, lines, dashed=True)
        axes.set_ylabel(f"momentum {name} (N m s)")
    panels[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    legend_above(figure, list(parts), dashed=True)
    return figure


@house_style()
def wheels(log: FlightLog, settings: WheelSettings) -> Figure:
    """Draw momentum and motor torque of every wheel, with their limits if they have any."""
    figure = page(18.0 + 55.0 * 2)
    above, below = figure.subplots(2, 1, sharex=True)
    time, held = log.time, settings.spin_momenta(log.wheel_velocities)
    plot_lines(above, time, held)
    plot_lines(below, time, log.wheel_torques)
    _mark_limits(above, settings.values("max_momentum"))
    _mark_limits(below, settings.values("max_torque"))
    above.set_ylabel("wheel's momentum (N m s)")
    below.set(xlabel="time (s)", ylabel="motor's torque (N m)")
    figure.align_ylabels()
    legend_above(figure, [f"wheel_{i + 1}" for i in range(settings.count)], dashed=False)
    return figure


@house_style()
def thrusters(log: FlightLog, pushed: Array, settings: ThrusterSettings) -> Figure:
    """Draw pulses, propellant, displacement of the robot, and the limit cycle of its attitude.

    Args:
        log: a flight.
        pushed: (N, 3) displacement of the robot's centre of mass from its start, m.
        settings: of the thrusters.
    """
    figure, time = page(210.0, ""), log.time
    rows = figure.add_gridspec(4, 1, height_ratios=(5, 3, 3, 6))
    pulses = figure.add_subplot(rows[0])
    used, place = (figure.add_subplot(rows[i], sharex=pulses) for i in (1, 2))
    cycle = figure.add_subplot(rows[3])
    _draw_pulses(pulses, time, log.thrusts / settings.values("force"), log.timebase.period)
    rates = log.thrusts / settings.values("force") * settings.mass_flow
    mass = log.timebase.period * np.cumsum(rates.sum(axis=1))
    plot_lines(used, time, 1e3 * mass[:, np.newaxis])
    used.set_ylabel("propellant (g)")
    plot_lines(place, time, pushed)
    place.set(xlabel="time (s)", ylabel="robot pushed (m)")
    for axes in (pulses, used):
        axes.tick_params(labelbottom=False)
    legend_above(place, [f"inertial {name}" for name in INERTIAL], dashed=False)
    _draw_cycle(cycle, log)
    legend_above(cycle, BASE_AXES, dashed=False)
    figure.align_ylabels([pulses, used, place])
    return figure


@house_style()
def torques_from_outside(log: FlightLog, torques: Mapping[str, Array]) -> Figure:
    """Draw the torque of each source about the common centre of mass, by inertial axis.

    Args:
        log: a flight in orbit.
        torques: see `space_robot.analysis.external_torques.torques_by_source`; sources that are
            zero all the time are left out.
    """
    shown = {name: torque for name, torque in torques.items() if np.any(torque)}
    figure = page(18.0 + 45.0 * max(1, len(shown)))
    panels = np.atleast_1d(figure.subplots(max(1, len(shown)), 1, sharex=True))
    for axes, (name, torque) in zip(panels, shown.items(), strict=False):
        plot_lines(axes, log.time, torque)
        axes.set_ylabel(f"{name.replace('_', ' ')} (N m)")
    panels[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    legend_above(figure, [f"inertial {name}" for name in INERTIAL], dashed=False)
    return figure


@house_style()
def deflections(log: FlightLog) -> Figure:
    """Draw motor angle less link angle of every joint with a gear."""
    figure = page(70.0)
    axes = figure.subplots()
    plot_lines(axes, log.time, deflection(log))
    axes.set(xlabel="time (s)", ylabel="deflection (rad or m)")
    legend_above(figure, list(log.geared_names), dashed=False)
    return figure


def _mark_limits(axes: Axes, limits: Array) -> None:
    """Draw limits other than 0 (no limit) as dotted lines at both signs."""
    for limit in np.unique(limits[limits > 0.0]):
        for side in (-limit, limit):
            axes.axhline(side, color=GREY, linewidth=0.8, linestyle=":", zorder=1.5)


def _draw_pulses(axes: Axes, time: Array, is_open: Array, period: float) -> None:
    """Draw one row per thruster, dark where it is open."""
    length = max(1, -(-len(time) // BINS))
    starts = np.arange(0, len(time), length)
    counts = np.diff(np.append(starts, len(time)))
    share = np.add.reduceat(np.nan_to_num(is_open), starts, axis=0) / counts[:, np.newaxis]
    count = is_open.shape[1]
    axes.imshow(
        share.T,
        cmap="Greys",
        vmin=0.0,
        vmax=1.0,
        aspect="auto",
        interpolation="nearest",
        extent=(time[0] - period, time[0] + (starts[-1] + length - 1) * period, count + 0.5, 0.5),
    )
    axes.grid(visible=False)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("thruster, open")
    axes.set_xlim(time[0] - period, time[-1])


def _draw_cycle(axes: Axes, log: FlightLog) -> None:
    """Draw the base's rate error over its attitude error, both about the base's axes."""
    every = max(1, log.ticks // POINTS)
    angle = np.radians(attitude_angles(log)[::every])
    rate = -relative_rate(log)[::every]
    for i in range(3):
        look = LineStyle.of(i)
        axes.plot(
            angle[:, i],
            rate[:, i],
            color=look.colour,
            linewidth=0.5,
            marker=look.marker,
            markevery=[len(angle) // 2],
        )
    axes.set(xlabel="attitude error (rad)", ylabel="rate error (rad/s)")
