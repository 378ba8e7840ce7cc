"""Actuators of a base in its scene: wheels that turn slowed down, plumes as long as the thrust.

A bag has the axes of the wheels and not their places: they are drawn outside of the base, where
they can be seen, each on its axis through the base's centre of mass.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings, WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import flown_actuators
from .extent import BaseSurface
from .frames import frame_rows
from .glb import revolved_glb
from .scene import rgb, set_pose, turns_from_z
from .shapes import cone, wheel

if TYPE_CHECKING:
    from viser import GlbHandle, MeshHandle, SceneApi

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
LENGTH = 0.7
"""Length of the plume of the strongest thruster, open all the time, relative to the base's size."""
THICK, THIN = 0.024, 0.085
"""Radius of a plume at the nozzle and at its end, relative to the same."""
NOZZLE = (0.012, 0.03, 0.07)
"""Radii of throat and exit of a nozzle, and its length, relative to the same."""
STRUT = 0.008
"""Radius of the strut that holds a nozzle beside the base, relative to the same."""
SHORTEST = 2.0**-7
"""Resolution of a plume's length, relative to the longest; shorter ones are not drawn."""
SIDES, RINGS = 12, 5
GLOW = {True: (0.35, 0.68, 1.0), False: (0.10, 0.42, 0.80)}
"""Red, green and blue of plumes on dark and on light pages."""
METAL = (92, 97, 107)


class ActuatorFrames(NamedTuple):
    """Motion of W wheels and thrust of T thrusters at K times."""

    angles: Array
    """(K, W) rad, slowed down."""
    is_saturated: Mask
    """(K, W) whether a wheel was at a limit of torque or momentum since the frame before."""
    thrusts: Array
    """(K, T) mean thrust since the frame before, N."""
    slowdown: float
    """Recorded turns of the wheels for each drawn one."""

    @classmethod
    def of(cls, log: FlightLog, flown: BaseActuatorSettings, times: Array) -> ActuatorFrames:
        """Integrate the wheels' speeds, and average the thrusts, means over the ticks' intervals.

        Args:
            log: the flight.
            flown: actuators of its base.
            times: (K,) of the frames, s.
        """
        rows, zero = frame_rows(log, times), np.zeros((1, flown.wheel_count))
        speeds = np.zeros((log.ticks, flown.wheel_count))
        for number, column in enumerate(log.wheel_velocities.T):
            if (known := np.isfinite(column)).any():
                speeds[:, number] = np.interp(log.time, log.time[known], column[known])
        steps = 0.5 * log.timebase.period * (speeds[1:] + speeds[:-1])
        turned = np.concatenate([zero, np.cumsum(steps, axis=0)])
        longest = float(np.diff(times).max(initial=0.0))
        slowdown = slowdown_of(float(np.abs(speeds).max(initial=0.0)), longest)
        starts = np.minimum(np.concatenate([rows[:1], rows[:-1] + 1]), rows)
        counts = (rows + 1 - starts)[:, np.newaxis]
        limited = at_limit(flown.wheels, log.wheel_velocities, log.wheel_torques)
        limited_before = np.concatenate([zero, np.cumsum(limited, axis=0)])
        thrust_before = np.zeros((log.ticks + 1, log.thrusts.shape[1]))
        np.cumsum(np.nan_to_num(log.thrusts), axis=0, out=thrust_before[1:])
        return cls(
            turned[rows] / slowdown,
            limited_before[rows + 1] > limited_before[starts],
            (thrust_before[rows + 1] - thrust_before[starts]) / counts,
            slowdown,
        )


def slowdown_of(speed: float, frame_s: float = 0.0) -> float:
    """Return how many times slower wheels of a speed, rad/s, are drawn: 1, 2 or 5 times 10^k.

    Args:
        speed: largest one.
        frame_s: time from one frame to the next, s.
    """
    least = max(speed / FASTEST, speed * frame_s / LARGEST_TURN, 1.0)
    decade = 10.0 ** np.floor(np.log10(least))
    return float(next(step for step in decade * np.array([1, 2, 5, 10]) if step >= least))


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


class DrawnActuators:
    """Wheels and thrusters on a robot's base."""

    def __init__(
        self,
        scene: SceneApi,
        robot_scene: RobotScene,
        robot: Robot,
        flown: BaseActuatorSettings,
        dark: bool,
    ) -> None:
        """Draw wheels, nozzles, and plumes of no length.

        Args:
            scene: of a server.
            robot_scene: the robot in it.
            robot: that carries them.
            flown: of its base.
            dark: whether the page is light on dark.
        """
        self._scene, self._root = scene, robot_scene.base.name
        surface = BaseSurface(robot)
        self._size = surface.size
        self._rotors: list[MeshHandle] = []
        self._is_red = [False] * flown.wheel_count
        self._plumes: list[GlbHandle] = []
        self._lengths = [0.0] * flown.thruster_count
        self._largest = 1.0
        if flown.wheel_count:
            axes = flown.wheels.unit_axes
            mesh = wheel(RADIUS * self._size, WIDTH * self._size)
            places = wheel_places(surface, robot.com[0], axes)
            for number, turn in enumerate(turns_from_z(axes)):
                path = f"{self._root}/wheel_{number + 1}"
                scene.add_frame(path, show_axes=False, position=places[number], wxyz=turn)
                rotor = scene.add_mesh_simple(
                    f"{path}/rotor", *mesh, color=rgb(COLOUR), flat_shading=True
                )
                self._rotors.append(rotor)
        if flown.thruster_count:
            thrusters, plume = flown.thrusters, plume_glb(self._size, dark)
            self._largest = float(thrusters.values("force").max())
            places = robot.com[0] + thrusters.places
            for number, away in enumerate(turns_from_z(-thrusters.unit_directions)):
                path, place = f"{self._root}/thruster_{number + 1}", places[number]
                self._add_strut(f"{path}_strut", surface.nearest(place), place)
                self._add_thruster(path, place, away, plume)

    def _add_thruster(self, path: str, place: Array, turn: Array, plume: bytes) -> None:
        throat, opening, length = (share * self._size for share in NOZZLE)
        nozzle = cone(throat, opening, length)
        self._scene.add_frame(path, show_axes=False, position=place, wxyz=turn)
        self._scene.add_mesh_simple(f"{path}/nozzle", *nozzle, color=METAL, flat_shading=False)
        handle = self._scene.add_glb(
            f"{path}/plume",
            plume,
            position=(0.0, 0.0, length),
            cast_shadow=False,
            receive_shadow=False,
            visible=False,
        )
        self._plumes.append(handle)

    def _add_strut(self, path: str, start: Array, end: Array) -> None:
        """Draw what holds a nozzle that is away from the base."""
        along = end - start
        length = float(np.linalg.norm(along))
        if length > NOZZLE[1] * self._size:
            mesh = cone(STRUT * self._size, STRUT * self._size, length)
            turn = turns_from_z(along[np.newaxis] / length)[0]
            self._scene.add_mesh_simple(path, *mesh, color=METAL, position=start, wxyz=turn)

    def move(self, angles: Array, is_saturated: Sequence[bool] | Mask, thrusts: Array) -> None:
        """Turn the wheels, and set the lengths of the plumes in proportion to the thrusts.

        Args:
            angles: (W,) rad.
            is_saturated: (W,) which wheels are drawn in another colour.
            thrusts: (T,) N.
        """
        for number, rotor in enumerate(self._rotors):
            half = 0.5 * float(angles[number])
            turn = np.array([np.cos(half), 0.0, 0.0, np.sin(half)])
            set_pose(rotor, "wxyz", np.round(turn / STEP) * STEP)
            if (red := bool(is_saturated[number])) != self._is_red[number]:
                self._is_red[number] = red
                rotor.color = rgb(SATURATED if red else COLOUR)
        shares = np.round(thrusts / (self._largest * SHORTEST)) * SHORTEST
        for number, (plume, share) in enumerate(zip(self._plumes, shares.tolist(), strict=True)):
            before, self._lengths[number] = self._lengths[number], share
            if share not in (before, 0.0):
                plume.scale = (1.0, 1.0, share)
            if (share > 0.0) != (before > 0.0):
                plume.visible = share > 0.0


def wheel_places(surface: BaseSurface, com: Array, axes: Array) -> Array:
    """Return where wheels with these unit axes (W, 3) are drawn, (W, 3) m, base frame.

    Wheels on a common axis through the centre of mass are one behind the other.
    """
    places = np.empty_like(axes)
    for number, axis in enumerate(axes):
        behind = int(np.count_nonzero(np.abs(axes[:number] @ axis) > 0.99))
        away = surface.distance(com, axis) + (0.6 + 1.4 * behind) * WIDTH * surface.size
        places[number] = com + away * axis
    return places


def plume_glb(size: float, dark: bool) -> bytes:
    """Return a plume along z as a GLB file: its light fades with the distance.

    Args:
        size: of the base, m.
        dark: whether the page is light on dark.
    """
    along = np.linspace(0.0, 1.0, RINGS)
    radii = size * (THICK + (THIN - THICK) * along)
    colours = np.column_stack([np.tile(GLOW[dark], (RINGS, 1)), 0.95 * (1.0 - along)])
    return revolved_glb(radii, size * LENGTH * along, colours, SIDES)


def actuator_notes(flown: BaseActuatorSettings, slowdown: float) -> list[str]:
    """Say how actuators are drawn whose wheels turn so many times slower, a sentence each."""
    notes = []
    if flown.wheel_count:
        speed = "as fast as" if slowdown == 1.0 else f"{slowdown:g} times slower than"
        notes.append(f"Wheels turn {speed} in flight; red: at a limit of torque or momentum.")
    if flown.thruster_count:
        force = float(flown.thrusters.values("force").max())
        notes.append(f"Plumes are as long as the mean thrust is large, the longest {force:g} N.")
    return notes


def described_actuators(log: FlightLog) -> BaseActuatorSettings:
    """Return the actuators of a flight's base; none if its bag does not describe them."""
    try:
        return flown_actuators(log)
    except InputError:
        return BaseActuatorSettings()
