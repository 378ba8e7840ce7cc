"""Pictures of one flight, as in the paper's Fig. 5 and Figs. 6 to 9."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from space_robot_msgs_py.bag.flight_log import FlightLog

from ..metrics import tracking_error
from ..waypoints import junction_ticks, waypoint_ticks
from .lines import draw_lines, mark_moments, tick_times
from .quantity import Quantity
from .scale import draw_scales
from .style import (
    LEFT,
    PAGE_WIDTH,
    RIGHT,
    TIME_AXIS,
    house_style,
    legend_above,
    legend_height,
    page,
    panel,
    title_height,
)

Array = NDArray[np.float64]

BASE_AXES = ("base x", "base y", "base z")
JUNCTION_HALF_WIDTH = 0.15
"""s on either side of a junction: long enough for the ripple to rise and die down."""
MOST_JUNCTIONS = 3
"""Junctions enlarged, from the first on: more would not fit beside one another."""

_PANEL_HEIGHT = 38.0
_COLUMN = (PAGE_WIDTH - 2 * LEFT - 2 * RIGHT) / 2
_GAP = 4.0
"""mm between panels."""


@house_style()
def desired_joints(log: FlightLog) -> Figure:
    """Fig. 5: the desired joint angles over time, each marked at the waypoints."""
    width, height = PAGE_WIDTH - LEFT - RIGHT, 62.0
    top = 2.0 + legend_height(log.joint_names, width)
    figure = page(top + height + TIME_AXIS)
    axes = panel(figure, LEFT, top, width, height)
    time, angles = tick_times(log), np.degrees(log.reference_joints[:, 0])
    waypoints = waypoint_ticks(log)
    quantity = Quantity.of(angles, "desired joint angle", "deg")
    draw_lines(axes, time, angles, quantity, marks=waypoints, dashed=True)
    mark_moments(axes, time[waypoints])
    axes.set_xlabel("time (s)")
    draw_scales(axes)
    legend_above(figure, LEFT, top, log.joint_names, width, dashed=True)
    return figure


@house_style()
def control_results(log: FlightLog, title: str) -> Figure:
    """Figs. 6 to 9: errors and torques of the base (left) and of the joints (right).

    Below, the torques are enlarged round the junctions of the mission's segments, if the flight
    has reached one.

    Args:
        log: a flight, whole or cut short.
        title: what was flown.
    """
    error, torque, time = tracking_error(log), log.applied_torque, tick_times(log)
    junctions = junction_ticks(log)[:MOST_JUNCTIONS]
    legend = max(legend_height(names, _COLUMN) for names in (BASE_AXES, log.joint_names))
    error_top = title_height(title) + legend
    torque_top = error_top + _PANEL_HEIGHT + _GAP
    enlarged_top = torque_top + _PANEL_HEIGHT + TIME_AXIS
    enlarged_height = _PANEL_HEIGHT + TIME_AXIS if len(junctions) else 0.0
    figure = page(enlarged_top + enlarged_height, title)
    columns = [
        (LEFT, slice(0, 3), BASE_AXES, ("attitude error", ""), ("base torque", "N m")),
        (PAGE_WIDTH - RIGHT - _COLUMN, slice(3, None), log.joint_names,
         ("joint error", "rad"), ("joint torque", "N m")),
    ]  # fmt: skip
    for left, part, names, error_name, torque_name in columns:
        errors = panel(figure, left, error_top, _COLUMN, _PANEL_HEIGHT)
        draw_lines(errors, time, error[:, part], Quantity.of(error[:, part], *error_name))
        legend_above(figure, left, error_top, names, _COLUMN, dashed=False)
        torques = panel(figure, left, torque_top, _COLUMN, _PANEL_HEIGHT)
        draw_lines(torques, time, torque[:, part], Quantity.of(torque[:, part], *torque_name))
        torques.set_xlabel("time (s)")
        for axes in (errors, torques):
            mark_moments(axes, time[junctions])
            draw_scales(axes, x_numbers=axes is torques)
        if len(junctions):
            stretches = [_round(moment, time, torque[:, part]) for moment in time[junctions]]
            _enlarge(figure, left, enlarged_top, time[junctions], stretches, torque_name)
    return figure


def _round(moment: float, time: Array, torque: Array) -> tuple[Array, Array]:
    """Time from ``moment``, s, and torque, of the ticks near it."""
    near = np.abs(time - moment) < JUNCTION_HALF_WIDTH + 1e-9
    return time[near] - moment, torque[near]


def _enlarge(
    figure: Figure,
    left: float,
    top: float,
    moments: Array,
    stretches: Sequence[tuple[Array, Array]],
    name: tuple[str, str],
) -> None:
    """Panels of torque round the junctions, beside one another on one scale."""
    width = (_COLUMN - _GAP * (len(stretches) - 1)) / len(stretches)
    quantity = Quantity.of(np.concatenate([torque for _, torque in stretches]), *name)
    panels: list[Axes] = []
    for number, (moment, (time, torque)) in enumerate(zip(moments, stretches, strict=True)):
        axes = panel(figure, left + number * (width + _GAP), top, width, _PANEL_HEIGHT)
        draw_lines(axes, 1e3 * time, torque, quantity)
        mark_moments(axes, np.zeros(1))
        axes.set_xlabel(f"time from {moment:g} s (ms)")
        if panels:
            axes.sharey(panels[0])
            axes.set_ylabel("")
        panels.append(axes)
    for axes in panels:
        draw_scales(axes, y_numbers=axes is panels[0])
