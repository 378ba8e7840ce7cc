"""Figures of one flight, as in the paper's Fig. 5 and Figs. 6 to 9."""

from __future__ import annotations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import GridSpec
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..described import event_times
from ..errors import attitude_angles, attitude_drift, controls_base, tracking_error
from ..waypoints import junction_ticks, waypoint_ticks
from .style import (
    PAGE_WIDTH,
    house_style,
    legend_above,
    mark_events,
    mark_moments,
    page,
    plot_lines,
)

Array = NDArray[np.float64]

BASE_AXES = ("base x", "base y", "base z")
JUNCTION_HALF_WIDTH = 0.15
"""Time before and after a junction, s: long enough for the ripple to rise and decay."""
MOST_LETTERS = 16
"""Maximum length of joint names in a label, in characters."""
MOST_JUNCTIONS = 3
"""Maximum number of enlarged junctions, from the first, that fit side by side."""


@house_style()
def desired_joints(log: FlightLog) -> Figure:
    """Draw Fig. 5: the desired joint angles over time, with markers at the waypoints.

    Prismatic joints have a separate panel.
    """
    slides = np.array(log.prismatic[: len(log.joint_names)])
    desired, time, waypoints = log.reference_joints[:, 0], log.time, waypoint_ticks(log)
    panels = [
        (np.flatnonzero(kind), values, label)
        for kind, values, label in (
            (~slides, np.degrees(desired), "desired joint angle (deg)"),
            (slides, desired, "desired joint position (m)"),
        )
        if kind.any()
    ]
    figure = page(80.0 if len(panels) == 1 else 120.0)
    below = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, (joints, values, label) in zip(below, panels, strict=True):
        plot_lines(
            axes, time, values[:, joints], looks=joints.tolist(), marks=waypoints, dashed=True
        )
        mark_moments(axes, time[waypoints])
        axes.set_ylabel(label)
    below[-1].set_xlabel("time (s)")
    legend_above(figure, log.joint_names, dashed=True)
    return figure


@house_style()
def control_results(log: FlightLog, title: str) -> Figure:
    """Draw Figs. 6 to 9: errors and torques of the base (left) and of the joints (right).

    Below, the torques are enlarged at the junctions of the mission's segments that the flight has
    reached; vertical lines are captures and releases. Without base actuators the base's drift is
    shown instead of its error.

    Args:
        log: a flight, complete or not.
        title: of the figure.
    """
    error, torque, time = tracking_error(log), log.applied_torque, log.time
    of_base, error[:, :3] = "attitude error (deg)", attitude_angles(log)
    if not controls_base(log):
        of_base, error[:, :3] = "attitude drift (deg)", np.degrees(attitude_drift(log))
    moments = time[junction_ticks(log)[:MOST_JUNCTIONS]]
    rows = 3 if len(moments) else 2
    figure = page(22.0 + 46.0 * rows, title)
    cells = figure.add_gridspec(rows, 2)
    for column, (part, names, error_label, torque_label) in enumerate(
        (
            (slice(0, 3), BASE_AXES, of_base, "base torque (N m)"),
            (slice(3, None), log.joint_names, *_joint_labels(log)),
        )
    ):
        errors = figure.add_subplot(cells[0, column])
        torques = figure.add_subplot(cells[1, column], sharex=errors)
        plot_lines(errors, time, error[:, part])
        plot_lines(torques, time, torque[:, part])
        for axes in (errors, torques):
            mark_moments(axes, moments)
            mark_events(axes, event_times(log))
        errors.tick_params(labelbottom=False)
        errors.set_ylabel(error_label)
        torques.set(xlabel="time (s)", ylabel=torque_label)
        legend_above(errors, names, dashed=False, width=PAGE_WIDTH / 2 - 20)
        if len(moments):
            enlarged = _enlarge(figure, cells, column, moments, time, torque[:, part])
            enlarged.set_ylabel(torque_label)
        figure.align_ylabels([errors, torques])
    return figure


def _joint_labels(log: FlightLog) -> tuple[str, str]:
    """Return the labels of the joints' errors and torques, with the units of the joints."""
    slides = log.prismatic[: len(log.joint_names)]
    if all(slides):
        return "joint error (m)", "joint force (N)"
    if not any(slides):
        return "joint error (rad)", "joint torque (N m)"
    sliding = ", ".join(n for n, is_so in zip(log.joint_names, slides, strict=True) if is_so)
    few = sliding if len(sliding) <= MOST_LETTERS else "prismatic"
    return f"joint error (rad; {few}: m)", f"joint torque (N m; {few}: N)"


def _enlarge(
    figure: Figure, cells: GridSpec, column: int, moments: Array, time: Array, torque: Array
) -> Axes:
    """Plot the torque at the junctions side by side on one scale; return the first panel."""
    below = cells[2, column].subgridspec(1, len(moments))
    panels = below.subplots(sharey=True, squeeze=False)[0].tolist()
    for axes, moment in zip(panels, moments, strict=True):
        near = np.abs(time - moment) < JUNCTION_HALF_WIDTH + 1e-9
        plot_lines(axes, 1e3 * (time[near] - moment), torque[near])
        mark_moments(axes, np.zeros(1))
        axes.set_xlabel(
            f"time from {moment:g} s (ms)"
            if len(moments) < MOST_JUNCTIONS
            else f"from {moment:g} s (ms)"
        )
        axes.locator_params(axis="x", nbins=7 if len(moments) == 1 else 3)
    first: Axes = panels[0]
    return first
