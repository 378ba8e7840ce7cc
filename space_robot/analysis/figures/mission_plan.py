"""The figure of a mission's plan: joints, tool, torque and momentum of the base."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from space_robot_model.robot import Robot

from ..mission_plan import PlannedSegment
from .style import house_style, legend_above, mark_moments, page, plot_lines, save_figure


@house_style()
def draw_plan(robot: Robot, segments: Sequence[PlannedSegment], stem: Path) -> tuple[Path, ...]:
    """Draw the plan to ``stem``.svg and ``stem``.png."""
    time = np.concatenate([segment.demand.time for segment in segments])
    joints = np.concatenate([segment.demand.joints[:, 0] for segment in segments])
    torque = np.concatenate([segment.demand.torque[:, :3] for segment in segments])
    momentum = np.concatenate([segment.demand.momentum for segment in segments])
    tool = np.concatenate([segment.tool for segment in segments])
    tool_time = np.concatenate(
        [np.linspace(s.piece.begin, s.piece.end, len(s.tool)) for s in segments]
    )
    figure = page(200.0)
    axes = figure.subplots(4, 1, sharex=True)
    panels = (
        (time, robot.to_degrees(joints), "joints (deg)", robot.joint_names),
        (tool_time, tool, "tool (m)", ("x", "y", "z")),
        (time, torque, "base torque (N m)", ("x", "y", "z")),
        (time, momentum, "momentum (N m s)", ("x", "y", "z")),
    )
    for panel, (at, values, label, names) in zip(axes, panels, strict=True):
        plot_lines(panel, at, values)
        panel.set_ylabel(label)
        legend_above(panel, list(names), dashed=False)
        mark_moments(panel, np.array([segment.piece.end for segment in segments[:-1]]))
    axes[-1].set_xlabel("time (s)")
    return save_figure(figure, stem)
