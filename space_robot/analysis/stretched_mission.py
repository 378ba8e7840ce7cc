"""A mission that asks less of the base: tools led with the least momentum, longer segments.

With k times the duration a segment from rest to rest asks for 1/k of the momentum and 1/k^2 of the
torque: see `space_robot_control.guidance.durations`.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import yaml

from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.guidance.segments import read_segments
from space_robot_msgs_py.config.yaml_text import parse_yaml

DIGITS = 3
"""Durations are rounded up to this many digits behind the point, s."""


def stretched_mission(
    settings: MissionSettings,
    report: Mapping[str, Any],
    base_torque: float | None,
    momentum: float | None,
) -> MissionSettings:
    """Return the mission with every segment as long as the limits ask for, or as it is if longer.

    Args:
        settings: of the mission.
        report: its `space_robot.analysis.mission_plan.plan_report`.
        base_torque: limit of every component of the base's torque, N m; None: none.
        momentum: limit of the angular momentum that the base takes up, N m s; None: none.
    """
    spans = []
    for segment in report["segments"]:
        factor = 1.0
        if base_torque is not None:
            factor = max(factor, float(np.sqrt(segment["base_torque"] / base_torque)))
        if momentum is not None:
            factor = max(factor, segment["momentum"] / momentum)
        span = segment["duration_s"] * factor
        spans.append(span if factor == 1.0 else float(np.ceil(span * 10**DIGITS) / 10**DIGITS))
    legs = len(settings.waypoint_times) - 1
    times = [0.0, *np.cumsum(spans[:legs]).tolist()]
    written = [text for text in settings.segments if text.strip()]
    segments = [_of_duration(text, span) for text, span in zip(written, spans[legs:], strict=True)]
    return settings.model_copy(update={"waypoint_times": times, "segments": segments or [""]})


def lightened_mission(settings: MissionSettings) -> MissionSettings:
    """Return the mission with ``least: momentum`` in all segments that lead a tool."""
    written = [text for text in settings.segments if text.strip()]
    segments = []
    for text, segment in zip(written, read_segments(written), strict=True):
        if segment.tool is not None and not segment.is_base_free:
            content = parse_yaml(text)
            content["tool"]["least"] = "momentum"
            text = json.dumps(content)
        segments.append(text)
    return settings.model_copy(update={"segments": segments or [""]})


def _of_duration(text: str, span: float) -> str:
    content = parse_yaml(text)
    (segment,) = read_segments([text])
    if segment.hold is None:
        content.pop("fast", None)
        content["duration"] = span
    return json.dumps(content)


def mission_text(settings: MissionSettings) -> str:
    """Return a mission as a document in YAML."""
    n = len(settings.waypoints_deg) // len(settings.waypoint_times)
    rows = [settings.waypoints_deg[k : k + n] for k in range(0, len(settings.waypoints_deg), n)]
    spans = [round(end - begin, 9) for begin, end in pairwise(settings.waypoint_times)]
    legs = [{"joints_deg": row, "duration": s} for row, s in zip(rows[1:], spans, strict=True)]
    segments = [parse_yaml(text) for text in settings.segments if text.strip()]
    start = {"joints_deg": rows[0], "base": {"quaternion": settings.base_quaternion}}
    document = {"mission": {"start": start, "segments": [*legs, *segments]}}
    return yaml.safe_dump(document, sort_keys=False, default_flow_style=None, width=100)
