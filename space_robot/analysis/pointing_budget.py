"""What the base's pointing is measured against: axis, band and window."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.robot.mission_document import Vector
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.config.yaml_text import parse_yaml

Array = NDArray[np.float64]
Z = (0.0, 0.0, 1.0)


class PointingBudget(StrictModel):
    """What the base's pointing is measured against."""

    band_deg: Annotated[float, Field(gt=0.0, le=180.0)] = Field(
        0.1, description="angle within which the base points well, degrees"
    )
    window_s: Annotated[float, Field(gt=0.0, le=1e6)] = Field(
        1.0, description="window over which jitter counts, s"
    )
    axis: Vector | None = Field(
        None,
        description="axis of the base that points, base frame, any length (none: of the mission's "
        "first pointing segment, or of its start, else z)",
    )

    @field_validator("axis", mode="after")
    @classmethod
    def _has_direction(cls, axis: list[float] | None) -> list[float] | None:
        if axis is not None:
            direction_norm(axis, "axis")
        return axis

    def of(self, segments: Sequence[str], start: str = "") -> PointingBudget:
        """Return the budget with the axis that points, of unit length.

        Args:
            segments: of the mission, as YAML texts.
            start: what the base points at from the start on, as YAML text; empty: nothing.
        """
        pointed = pointed_axis(segments, start)
        axis = np.array(self.axis or (Z if pointed is None else pointed))
        unit = (axis / direction_norm(axis, "axis")).tolist()
        return self.model_copy(update={"axis": unit})


def pointed_axis(segments: Sequence[str], start: str = "") -> Array | None:
    """Return the axis (3,) of the first segment of a mission that points the base; None: none does.

    ``segments`` and ``start`` as in `PointingBudget.of`.
    """
    for text in [*segments, f"base: {start}"]:
        with suppress(ValueError, TypeError, AttributeError):  # a bag may hold anything
            base = parse_yaml(text).get("base")
            base = {"point": base} if base == "nadir" else base
            if isinstance(base, dict) and "point" in base:
                axis = np.array(base.get("axis", Z), dtype=np.float64)
                direction_norm(axis, "axis")
                return axis
    return None


def pointing_of(log: FlightLog) -> tuple[list[str], str]:
    """Return segments and start of a log's mission, see `PointingBudget.of`, as far as it tells."""
    if log.scenario is not None:
        return log.scenario.mission.written_segments, log.scenario.mission.base_point
    scenario = log.flight.get("scenario")
    mission = scenario.get("mission") if isinstance(scenario, dict) else None
    if not isinstance(mission, dict):
        return [], ""
    segments = mission.get("segments")
    texts = [str(text) for text in segments] if isinstance(segments, list) else []
    return texts, str(mission.get("base_point") or "")


def window_ticks(window_s: float, period: float) -> int:
    """Return the number of ticks in a window, at least 2; ``period`` in s."""
    return max(2, round(window_s / period))
