"""Figures of one flight, the paper's Fig. 5 to 9 and those of plotted quantities, and of a plan."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.gridspec import SubplotSpec
from matplotlib.ticker import MaxNLocator

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from ..analysed_log import AnalysedLog
from ..described import event_times
from ..errors import attitude_angles, junction_ticks, relative_rate, tracking_error, waypoint_ticks
from ..mission_plan import PlannedSegment
from ..plotted import AXES as XYZ
from ..plotted import PlottedQuantity, flown_quantities
from .style import (
    NARROW_PAGE,
    PAGE_WIDTH,
    LineStyle,
    binned,
    house_style,
    legend_above,
    legend_inside,
    mark_events,
    mark_limits,
    mark_moments,
    page,
    plot_lines,
    save_figure,
)

BASE_AXES = ("base x", "base y", "base z")
JUNCTION_HALF_WIDTH = 0.15
"""Time before and after a junction, s: long enough for the ripple to rise and decay."""
MOST_LETTERS = 16
"""Maximum length of joint names in a label, in characters."""
MOST_JUNCTIONS = 3
"""Maximum number of enlarged junctions, from the first, that fit side by side."""
BINS = 600
"""Columns of the raster of pulses; brightness shows the duty cycle of a thruster."""
POINTS = 6000
"""Maximum number of points of a line in the phase plane."""


@house_style()
def desired_joints(log: FlightLog, width: float = PAGE_WIDTH) -> Figure:
    """Draw Fig. 5: the desired joint angles over time, with markers at the waypoints.

    Prismatic joints have a separate panel.
    """
    time, waypoints = log.time, waypoint_ticks(log)
    panels = [quantity for _, quantity in flown_quantities(AnalysedLog(log), ["positions"])]
    figure = page(80.0 if len(panels) == 1 else 120.0, width=width)
    below = figure.subplots(len(panels), 1, sharex=True, squeeze=False)[:, 0]
    for axes, panel in zip(below, panels, strict=True):
        assert panel.wanted is not None
        looks = [log.joint_names.index(name) for name in panel.labels]
        plot_lines(axes, time, panel.wanted, looks=looks, marks=waypoints, dashed=True)
        mark_moments(axes, time[waypoints])
        kind = "angle" if panel.unit == "deg" else "position"
        axes.set_ylabel(f"desired joint {kind} ({panel.unit})")
    below[-1].set_xlabel("time (s)")
    if len(panels) == 1:
        legend_inside(below[0], log.joint_names, dashed=True)
    else:
        legend_above(figure, log.joint_names, dashed=True)
    return figure


@house_style()
def control_results(log: FlightLog, title: str, width: float = PAGE_WIDTH) -> Figure:
    """Draw Figs. 6 to 9: errors and torques of the base, and beside or below of the joints.

    Below, the torques are enlarged at the junctions of the mission's segments that the flight has
    reached; vertical lines are captures and releases. Without base actuators the base's drift is
    shown instead of its error. The flight need not be complete.
    """
    (_, attitude), *_ = flown_quantities(AnalysedLog(log), ["attitude"])
    error, torque, time = tracking_error(log)[:, 3:], log.applied_torque, log.time
    moments = time[junction_ticks(log)[:MOST_JUNCTIONS]]
    rows = 3 if len(moments) else 2
    is_narrow = width < NARROW_PAGE
    figure = page(22.0 + (68.0 if is_narrow else 46.0) * rows, title, width)
    heights = 2 * [1.0, 1.0, 1.4][:rows] if is_narrow else None
    cells = figure.add_gridspec(*(2 * rows, 1) if is_narrow else (rows, 2), height_ratios=heights)
    for column, (values, part, names, error_label, torque_label) in enumerate(
        (
            (attitude.values, slice(0, 3), BASE_AXES, attitude.label, "base torque (N m)"),
            (error, slice(3, None), log.joint_names, *_joint_labels(log)),
        )
    ):
        first = (column * rows, 0) if is_narrow else (0, column)
        errors = figure.add_subplot(cells[first])
        torques = figure.add_subplot(cells[first[0] + 1, first[1]], sharex=errors)
        plot_lines(errors, time, values)
        plot_lines(torques, time, torque[:, part])
        for axes in (errors, torques):
            mark_moments(axes, moments)
            mark_events(axes, event_times(log))
        errors.tick_params(labelbottom=False)
        errors.set_ylabel(error_label)
        torques.set(xlabel="time (s)", ylabel=torque_label)
        legend_above(errors, names, dashed=True)
        if len(moments):
            cell = cells[first[0] + 2, first[1]]
            enlarged = _enlarge(figure, cell, moments, time, torque[:, part])
            enlarged.set_ylabel(torque_label)
        figure.align_ylabels([errors, torques])
    return figure


def _joint_labels(log: FlightLog) -> tuple[str, str]:
    slides = log.prismatic[: len(log.joint_names)]
    if all(slides):
        return "joint error (m)", "joint force (N)"
    if not any(slides):
        return "joint error (rad)", "joint torque (N m)"
    sliding = ", ".join(n for n, is_so in zip(log.joint_names, slides, strict=True) if is_so)
    few = sliding if len(sliding) <= MOST_LETTERS else "prismatic"
    return f"joint error (rad; {few}: m)", f"joint torque (N m; {few}: N)"


def _enlarge(figure: Figure, cell: SubplotSpec, moments: Array, time: Array, torque: Array) -> Axes:
    below = cell.subgridspec(1, len(moments))
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


@house_style()
def kind_figure(
    log: FlightLog, quantities: Sequence[PlottedQuantity], width: float = PAGE_WIDTH
) -> Figure:
    """Draw quantities of a kind below one another, with their limits; pulses as a raster."""
    heights = [60.0 if quantity.are_pulses else 45.0 for quantity in quantities]
    figure = page(18.0 + sum(heights), width=width)
    panels = figure.subplots(len(heights), 1, sharex=True, squeeze=False, height_ratios=heights)[
        :, 0
    ]
    lines = [quantity for quantity in quantities if not quantity.are_pulses]
    is_common = len({tuple(quantity.labels) for quantity in lines}) == 1
    for axes, quantity in zip(panels, quantities, strict=True):
        if quantity.are_pulses:
            _draw_pulses(axes, log.time, quantity.values, log.timebase.period)
            continue
        looks = _looks(log, quantity.labels)
        plot_lines(axes, log.time, quantity.values, looks=looks)
        mark_limits(axes, quantity.limits, quantity.values)
        axes.set_ylabel(quantity.label)
        if not is_common:
            legend_inside(axes, quantity.labels, dashed=True, looks=looks)
    panels[-1].set_xlabel("time (s)")
    figure.align_ylabels()
    if is_common:
        looks = _looks(log, lines[0].labels)
        legend_above(figure, lines[0].labels, dashed=True, looks=looks)
    return figure


def _looks(log: FlightLog, labels: Sequence[str]) -> list[int]:
    joints = list(log.joint_names)  # a joint looks the same in all figures
    return [joints.index(name) if name in joints else k for k, name in enumerate(labels)]


def _draw_pulses(axes: Axes, time: Array, is_open: Array, period: float) -> None:
    length, count = max(1, -(-len(time) // BINS)), is_open.shape[1]
    share = binned(time, np.nan_to_num(is_open), length)[2]
    axes.imshow(
        share.T,
        cmap="Greys",
        vmin=0.0,
        vmax=1.0,
        aspect="auto",
        interpolation="nearest",
        extent=(time[0] - period, time[0] + (len(share) * length - 1) * period, count + 0.5, 0.5),
    )
    axes.grid(visible=False)
    axes.yaxis.set_major_locator(MaxNLocator(integer=True))
    axes.set_ylabel("thruster, open")
    axes.set_xlim(time[0] - period, time[-1])


@house_style()
def limit_cycle(log: FlightLog, width: float = PAGE_WIDTH) -> Figure:
    """Draw the base's rate error over its attitude error, both about the base's axes."""
    figure, every = page(90.0, width=width), max(1, log.ticks // POINTS)
    axes = figure.subplots()
    angle, rate = attitude_angles(log)[::every], -np.degrees(relative_rate(log)[::every])
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
    axes.set(xlabel="attitude error (deg)", ylabel="rate error (deg/s)")
    legend_inside(axes, BASE_AXES, dashed=False)
    return figure


@house_style()
def draw_plan(robot: Robot, segments: Sequence[PlannedSegment], stem: Path) -> tuple[Path, ...]:
    """Draw the plan to ``stem``.svg and ``stem``.png."""
    demands = [segment.demand for segment in segments]
    time = [asked.time for asked in demands]
    tool_time = [np.linspace(s.piece.begin, s.piece.end, len(s.tool)) for s in segments]
    joints = [robot.to_degrees(asked.joints[:, 0]) for asked in demands]
    figure = page(200.0)
    axes = figure.subplots(4, 1, sharex=True)
    panels = (
        (time, joints, "joints (deg)", robot.joint_names),
        (tool_time, [segment.tool for segment in segments], "tool (m)", XYZ),
        (time, [asked.torque[:, :3] for asked in demands], "base torque (N m)", XYZ),
        (time, [asked.momentum for asked in demands], "momentum (N m s)", XYZ),
    )
    for panel, (at, values, label, names) in zip(axes, panels, strict=True):
        plot_lines(panel, np.concatenate(at), np.concatenate(values))
        panel.set_ylabel(label)
        legend_inside(panel, list(names), dashed=True)
        mark_moments(panel, np.array([segment.piece.end for segment in segments[:-1]]))
    axes[-1].set_xlabel("time (s)")
    return save_figure(figure, stem)
