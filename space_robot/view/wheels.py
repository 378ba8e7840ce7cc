"""Reaction wheels in a scene: they turn with their recorded speeds, slowed down.

A bag has the axes of the wheels and not their places: they are drawn outside of the base, where
they can be seen, each on its axis through the base's centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from .arrows import turns_from_z
from .base_surface import base_size, distance_to_surface
from .frames import frame_rows
from .scene import rgb, set_pose
from .solids import wheel as wheel_mesh

if TYPE_CHECKING:
    from viser import MeshHandle, SceneApi

    from .scene import RobotScene

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

FASTEST = 4.0
"""Largest speed at which a wheel is drawn, rad/s."""
LARGEST_TURN = 0.5
"""Largest turn from one frame to the next, rad: with larger ones it would seem to turn back."""
RADIUS, WIDTH = 0.13, 0.045
"""Of a wheel, relative to the size of the base."""
STEP = 2.0**-14
"""Resolution of the drawn attitudes, which keeps the page small."""
AT_LIMIT = 1.0 - 1e-3
"""Share of a wheel's largest torque or momentum at which it is saturated."""
COLOUR, SATURATED = "#B9C0CC", "#E5383B"


class WheelFrames(NamedTuple):
    """Motion of W wheels at K times."""

    angles: Array
    """(K, W) rad, slowed down."""
    is_saturated: Mask
    """(K, W) whether a wheel was at a limit of torque or momentum since the frame before."""
    slowdown: float
    """Recorded turns for each drawn one."""

    @classmethod
    def of(cls, log: FlightLog, wheels: WheelSettings, times: Array) -> WheelFrames:
        """Integrate the recorded speeds by the trapezoidal rule.

        Args:
            log: the flight.
            wheels: of its base.
            times: (K,) of the frames, s.
        """
        ticks = log.time
        speeds = np.column_stack([_known(ticks, column) for column in log.wheel_velocities.T])
        turned = np.zeros_like(speeds)
        np.cumsum(0.5 * log.timebase.period * (speeds[1:] + speeds[:-1]), axis=0, out=turned[1:])
        gaps = np.diff(times)
        longest = float(gaps.max()) if len(gaps) else 0.0
        slowdown = slowdown_of(float(np.abs(speeds).max(initial=0.0)), longest)
        rows = frame_rows(log, times)
        limited = at_limit(wheels, log.wheel_velocities, log.wheel_torques)
        return cls(turned[rows] / slowdown, _since(limited, rows), slowdown)


def slowdown_of(speed: float, frame_s: float = 0.0) -> float:
    """Return how many times slower wheels of a speed, rad/s, are drawn: 1, 2 or 5 times 10^k.

    Args:
        speed: largest one.
        frame_s: time from one frame to the next, s.
    """
    least = max(speed / FASTEST, speed * frame_s / LARGEST_TURN, 1.0)
    decade = 10.0 ** np.floor(np.log10(least))
    return float(next(step for step in decade * np.array([1, 2, 5, 10]) if step >= least))


def _known(ticks: Array, values: Array) -> Array:
    """Return values without gaps."""
    known = np.isfinite(values)
    return np.interp(ticks, ticks[known], values[known]) if known.any() else np.zeros(len(ticks))


def at_limit(wheels: WheelSettings, speeds: Array, torques: Array) -> Mask:
    """Return whether wheels are at a limit, (..., W).

    Args:
        wheels: with their limits.
        speeds: (..., W) rad/s.
        torques: (..., W) of their motors, N m.
    """
    # the comparison with NaN is false
    return np.asarray(
        (np.abs(wheels.spin_momenta(speeds)) >= AT_LIMIT * wheels.limits("max_momentum"))
        | (np.abs(torques) >= AT_LIMIT * wheels.limits("max_torque"))
    )


def _since(flags: Mask, rows: NDArray[np.intp]) -> Mask:
    """Return whether a flag (N, W) was set after the row of the frame before, (K, W)."""
    counts = np.concatenate([np.zeros((1, flags.shape[1])), np.cumsum(flags, axis=0)])
    before = np.concatenate([rows[:1] - 1, rows[:-1]])
    return np.asarray(counts[rows + 1] > counts[np.minimum(before + 1, rows)])


class DrawnWheels:
    """The wheels on a robot's base."""

    def __init__(
        self, scene: SceneApi, robot_scene: RobotScene, robot: Robot, wheels: WheelSettings
    ) -> None:
        """Draw them.

        Args:
            scene: of a server.
            robot_scene: the robot in it.
            robot: that carries them.
            wheels: of its base.
        """
        size = base_size(robot)
        mesh = wheel_mesh(RADIUS * size, WIDTH * size)
        self._rotors: list[MeshHandle] = []
        self._is_red = [False] * wheels.count
        turns = turns_from_z(wheels.unit_axes)
        for number, place in enumerate(wheel_places(robot, wheels.unit_axes)):
            path = f"{robot_scene.base.name}/wheel_{number + 1}"
            scene.add_frame(path, show_axes=False, position=place, wxyz=turns[number])
            self._rotors.append(
                scene.add_mesh_simple(f"{path}/rotor", *mesh, color=rgb(COLOUR), flat_shading=True)
            )

    def move(self, angles: Array, is_saturated: Sequence[bool] | Mask) -> None:
        """Turn them.

        Args:
            angles: (W,) rad.
            is_saturated: (W,) which are drawn in another colour.
        """
        for number, rotor in enumerate(self._rotors):
            half = 0.5 * float(angles[number])
            turn = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
            set_pose(rotor, "wxyz", np.round(turn / STEP) * STEP)
            if (red := bool(is_saturated[number])) != self._is_red[number]:
                self._is_red[number] = red
                rotor.color = rgb(SATURATED if red else COLOUR)


def wheel_places(robot: Robot, axes: Array) -> Array:
    """Return where wheels with these unit axes (W, 3) are drawn, (W, 3) m, base frame.

    Wheels on a common axis are one behind the other.
    """
    size, com = base_size(robot), robot.com[0]
    places = np.empty_like(axes)
    for number, axis in enumerate(axes):
        behind = int(np.count_nonzero(np.abs(axes[:number] @ axis) > 0.99))
        away = distance_to_surface(robot, com, axis) + (0.6 + 1.4 * behind) * WIDTH * size
        places[number] = com + away * axis
    return places
