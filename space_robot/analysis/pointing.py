"""Pointing of the end effector and of the base, which a mission is flown for.

The tool's pose follows from base attitude and joint angles (`placements.tool_pose`), once with the
measured ones and once with the desired ones. The base's position is free in this mission
("semi-floating"), so both poses share it and its drift is given separately.

The base's error is the rotation from its desired attitude, as in a pointing budget
(ECSS-E-ST-60-10C): the absolute performance error (APE) is the error at a tick, the relative one
(RPE, here "jitter") its difference from its mean over a window.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from typing import Annotated, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from pydantic import Field, field_validator

from space_robot_model.elementary.matrices import direction_norm, dot_rows, norms, unit_rows
from space_robot_model.robot import Robot
from space_robot_model.robot.mission_document import Vector
from space_robot_model.robot.placements import tool_pose
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.config.yaml_text import parse_yaml

from .metrics import AxisMaximum, AxisRms, Table, attitude_error, rotation_vectors

Array = NDArray[np.float64]

ARCSEC = np.pi / 180.0 / 3600.0
"""rad."""
BASE_ANGLES = ("half_cone_arcsec", "about_arcsec", "rotation_arcsec")
"""Keys of the angles of a `BasePointingError`."""


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
        pointed = pointed_axis([*segments, f"base: {start}"])
        axis = np.array(self.axis or (Z if pointed is None else pointed))
        unit = (axis / direction_norm(axis, "axis")).tolist()
        return self.model_copy(update={"axis": unit})


class PointingError(NamedTuple):
    """The end effector's error, tick by tick."""

    boresight: Array
    """(N,) rad, between the measured and the desired direction of the tool's z axis."""
    rotation: Array
    """(N,) rad, of the one rotation that turns the desired frame into the measured one."""
    position: Array
    """(N,) m, between measured and desired position, the base at its measured position in both."""
    base_drift: Array
    """(N,) m, of the base's CoM from where it was at the first tick."""


class Pointing(Metric):
    """Takes RMS, maximum and last value of each number of a `PointingError`."""

    def __init__(self, log: FlightLog, robot: Robot) -> None:
        """``log``: the first rows; the base's drift counts from there."""
        self._robot, self._start = robot, log.base_position[:1].copy()
        figures = len(PointingError._fields)
        self._rms, self._maximum = AxisRms(figures), AxisMaximum(figures)
        self._end: Array = np.empty(0)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        values = np.stack(pointing_error(log, self._robot, self._start)).T
        self._rms.add(values)
        self._maximum.add(values)
        self._end = values[-1]

    def result(self) -> Table:
        """``rms``, ``max`` and ``end`` by figure."""
        names = ("boresight_rad", "rotation_rad", "tool_position_m", "base_drift_m")
        kinds = {"rms": self._rms.value, "max": self._maximum.value, "end": self._end}
        return {
            name: {kind: float(values[i]) for kind, values in kinds.items()}
            for i, name in enumerate(names)
        }


class BasePointingError(NamedTuple):
    """The rotation from the base's desired attitude to the true one, tick by tick."""

    half_cone: Array
    """(N,) rad, between the true and the desired direction of the axis that points."""
    about: Array
    """(N,) rad, size of the rotation about that axis."""
    rotation: Array
    """(N,) rad, of the one rotation between both attitudes."""
    vector: Array
    """(N, 3) rad, that rotation as a vector, base axes."""

    @property
    def angles(self) -> Array:
        """(N, 3) arcsec, by `BASE_ANGLES`."""
        angles: Array = np.stack(self[:3], axis=1) / ARCSEC
        return angles


def base_pointing_error(log: FlightLog, axis: Array) -> BasePointingError:
    """Compute the base's error of pointing at every tick.

    Args:
        log: rows of a flight.
        axis: (3,) that points, base frame, unit length.
    """
    error = attitude_error(log)
    eps = error[:, 1:]
    about = dot_rows(eps, axis[np.newaxis])
    vector = rotation_vectors(error)
    across, rest = eps - about * axis, np.hstack([error[:, :1], about])
    return BasePointingError(
        half_cone=2.0 * np.arctan2(norms(across), norms(rest)),
        about=2.0 * np.arctan2(np.abs(about[:, 0]), error[:, 0]),
        rotation=norms(vector),
        vector=vector,
    )


class Jitter:
    """Difference of the error from its mean in windows that follow one another, in parts.

    Of the vector about the axis, across it (the half cone), and of its length, by `BASE_ANGLES`.
    A window that the flight does not fill does not count.
    """

    def __init__(self, ticks: int, axis: Array) -> None:
        """``ticks``: of a window; ``axis``: (3,) that points, base frame, unit length."""
        self._ticks, self._axis = ticks, axis
        self._rest: Array = np.empty((0, 3))
        self._rms, self._maximum = AxisRms(3), AxisMaximum(3)

    def add(self, vectors: Array) -> None:
        """Take further rows (N, 3), rad."""
        rows = np.concatenate([self._rest, vectors])
        whole = len(rows) - len(rows) % self._ticks
        self._rest = rows[whole:].copy()
        windows = rows[:whole].reshape(-1, self._ticks, 3)
        away = (windows - windows.mean(axis=1, keepdims=True)).reshape(-1, 3)
        about = dot_rows(away, self._axis[np.newaxis])
        sizes = [norms(away - about * self._axis), np.abs(about[:, 0]), norms(away)]
        angles = np.stack(sizes, axis=1) / ARCSEC
        self._rms.add(angles)
        self._maximum.add(angles)

    @property
    def value(self) -> tuple[Array, Array] | None:
        """RMS and largest, (3,) arcsec each; None: no window was full."""
        return (self._rms.value, self._maximum.value) if self._rms.rows else None


class BasePointing(Metric):
    """RMS, maximum and last value, share of time within a band, and jitter of the base's angles."""

    def __init__(self, log: FlightLog, budget: PointingBudget | None = None) -> None:
        """``log``: the first rows; ``budget``: None for the default."""
        segments, start = pointing_of(log)
        self._points = pointed_axis([*segments, f"base: {start}"]) is not None
        self._budget = (budget or PointingBudget()).of(segments, start)
        self._axis = np.array(self._budget.axis)
        self._rms, self._maximum = AxisRms(3), AxisMaximum(3)
        self._within, self._end = np.zeros(3), np.zeros(3)
        ticks = window_ticks(self._budget.window_s, log.timebase.period)
        self._jitter = Jitter(ticks, self._axis)

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        self.add_error(base_pointing_error(log, self._axis))

    def add_error(self, error: BasePointingError) -> None:
        """Take the error of further rows, at least one, about the budget's axis."""
        angles = error.angles
        self._rms.add(angles)
        self._maximum.add(angles)
        self._within += np.sum(angles <= 3600.0 * self._budget.band_deg, axis=0)
        self._end = angles[-1]
        self._jitter.add(error.vector)

    def result(self) -> dict[str, Any]:
        """Return whether the mission points the base, budget, and the numbers by `BASE_ANGLES`."""
        jitter = self._jitter.value
        figures = {
            "rms": self._rms.value,
            "max": self._maximum.value,
            "end": self._end,
            "within_band": self._within / self._rms.rows,
            "jitter_rms": jitter and jitter[0],
            "jitter_max": jitter and jitter[1],
        }
        return {
            "points": self._points,
            **self._budget.model_dump(),
            **{
                name: {
                    kind: None if values is None else float(values[i])
                    for kind, values in figures.items()
                }
                for i, name in enumerate(BASE_ANGLES)
            },
        }


def window_ticks(window_s: float, period: float) -> int:
    """Return the number of ticks in a window, at least 2; ``period`` in s."""
    return max(2, round(window_s / period))


def pointed_axis(segments: Sequence[str]) -> Array | None:
    """Return the axis (3,) of the first segment of a mission that points the base; None: none does.

    Args:
        segments: as YAML texts.
    """
    for text in segments:
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
    scenario = log.flight.get("scenario")
    mission = scenario.get("mission") if isinstance(scenario, dict) else None
    if not isinstance(mission, dict):
        return [], ""
    segments = mission.get("segments")
    texts = [str(text) for text in segments] if isinstance(segments, list) else []
    return texts, str(mission.get("base_point") or "")


def pointing_error(log: FlightLog, robot: Robot, start: Array | None = None) -> PointingError:
    """Compute the error of the tool's pose at every tick of a flight of ``robot``.

    Joints without motors are desired to be at rest where their springs hold them.
    ``start``: (1, 3) m, where the base was when the flight began (None: at the first tick here).
    """
    start = log.base_position[:1] if start is None else start
    actual, place = tool_pose(robot, unit_rows(log.quaternion), log.all_positions)
    rest = np.broadcast_to([spring.rest for spring in robot.springs], log.passive_positions.shape)
    joints = np.hstack([log.reference_joints[:, 0], rest])
    desired, wanted = tool_pose(robot, unit_rows(log.reference_base[:, :4]), joints)
    return PointingError(
        boresight=angle_between(actual[:, :, 2], desired[:, :, 2]),
        rotation=rotation_angle(actual, desired),
        position=np.linalg.norm(place - wanted, axis=1),
        base_drift=np.linalg.norm(log.base_position - start, axis=1),
    )


def angle_between(first: Array, second: Array) -> Array:
    """(N,) rad between unit vectors (N, 3), as exact for small angles as for large ones."""
    across = np.linalg.norm(np.cross(first, second), axis=1)
    angle: Array = np.arctan2(across, np.sum(first * second, axis=1))
    return angle


def rotation_angle(first: Array, second: Array) -> Array:
    """(N,) rad of the rotation ``first second^T`` (N, 3, 3), exact for small angles.

    ``sin = |vee(R - R^T)| / 2``, ``cos = (trace(R) - 1) / 2``.
    """
    axes = [(first[:, :, k], second[:, :, k]) for k in range(3)]
    # vee(a b^T - b a^T) = b x a for each pair of columns; trace(R) is the sum of their products
    sine = 0.5 * np.linalg.norm(sum(np.cross(b, a) for a, b in axes), axis=1)
    cosine = 0.5 * (sum(np.sum(a * b, axis=1) for a, b in axes) - 1.0)
    angle: Array = np.arctan2(sine, cosine)
    return angle
