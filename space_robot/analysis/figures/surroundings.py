"""Figures of what acts in an orbit, and of the gears' deflections."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from matplotlib.figure import Figure
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..actuation import deflection
from .base_actuators import INERTIAL
from .style import house_style, legend_above, page, plot_lines

Array = NDArray[np.float64]


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
