"""Actuators of a base in its scene: wheels that turn slowed down, plumes as long as the thrust.

A bag has the axes of the wheels and not their places: they are drawn outside of the base, where
they can be seen, each on its axis through the base's centre of mass.
"""

from __future__ import annotations

from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings, WheelSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError

from ..analysis.described import flown_actuators
from .frames import Move, frame_rows
from .meshes import cone, revolved_glb, wheel
from .scene import rgb, set_pose, turns_from_z
from .shapes import BaseSurface

if TYPE_CHECKING:
    from viser import GlbHandle, MeshHandle, SceneApi

Mask = NDArray[np.bool_]

FASTEST = 4.0
"""Largest speed at which a wheel is drawn, rad/s."""
LARGEST_TURN = 0.5
"""Largest turn from one frame to the next, rad: with larger ones it would seem to turn back."""
RADIUS, WIDTH = 0.13, 0.045
"""Of a wheel, relative to the size of the base."""
RIM_POINTS, WHEEL_RINGS = 36, (0.5, 1.0)
"""Points around a wheel that must be outside of the base, and their distances from its axis,
relative to its radius."""
STEP = 2.0**-14
"""Resolution of the drawn attitudes, which keeps the page small."""
AT_LIMIT = 1.0 - 1e-3
"""Share of a wheel's largest torque or momentum at which it is saturated."""
COLOUR, SATURATED = "#B9C0CC", "#E5383B"
LENGTH = 0.7
"""Length of the plume of the strongest thruster, open all the time, relative to the base's size."""
THICK, THIN = 0.024, 0.085
"""Radius of a plume at the nozzle and at its end, relative to the same."""
NOZZLE, STRUT = (0.012, 0.03, 0.07), 0.008
"""Radii of throat and exit of a nozzle, and its length, relative to the same; radius of the strut
that holds it off the base."""
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
        """Integrate the wheels' speeds, and average the thrusts, to ``times`` (K,), s.

        Speeds and thrusts are means over the ticks' intervals.
        """
        rows = frame_rows(log, times)
        speeds = np.zeros((log.ticks, flown.wheel_count))
        for number, column in enumerate(log.wheel_velocities.T):
            if (known := np.isfinite(column)).any():
                speeds[:, number] = np.interp(log.time, log.time[known], column[known])
        turned = _sums(0.5 * log.timebase.period * (speeds[1:] + speeds[:-1]))[rows]
        longest = float(np.diff(times).max(initial=0.0))
        slowdown = wheel_slowdown(float(np.abs(speeds).max(initial=0.0)), longest)
        starts = np.minimum(np.concatenate([rows[:1], rows[:-1] + 1]), rows)
        counts = (rows + 1 - starts)[:, np.newaxis]
        limited = _sums(_at_limit(flown.wheels, log.wheel_velocities, log.wheel_torques))
        thrusts = _sums(np.nan_to_num(log.thrusts))
        return cls(
            turned / slowdown,
            limited[rows + 1] > limited[starts],
            (thrusts[rows + 1] - thrusts[starts]) / counts,
            slowdown,
        )


def _sums(values: Array | Mask) -> Array:
    """Return the sums of the first 0, 1, ... N rows of (N, C) values."""
    return np.concatenate([np.zeros((1, values.shape[1])), np.cumsum(values, axis=0)])


def wheel_slowdown(speed: float, frame_s: float = 0.0) -> float:
    """Return how many times slower wheels are drawn: 1, 2 or 5 times 10^k.

    Their largest ``speed`` is in rad/s, the time from one frame to the next in s.
    """
    least = max(speed / FASTEST, speed * frame_s / LARGEST_TURN, 1.0)
    decade = 10.0 ** np.floor(np.log10(least))
    return float(next(step for step in decade * np.array([1, 2, 5, 10]) if step >= least))


def _at_limit(wheels: WheelSettings, speeds: Array, torques: Array) -> Mask:
    # the comparison with NaN is false
    return np.asarray(
        (np.abs(wheels.spin_momenta(speeds)) >= AT_LIMIT * wheels.limits("max_momentum"))
        | (np.abs(torques) >= AT_LIMIT * wheels.limits("max_torque"))
    )


def add_actuators(
    scene: SceneApi, base: str, robot: Robot, log: FlightLog, times: Array, dark: bool
) -> list[Move]:
    """Draw wheels and thrusters on a robot's base; return what moves them.

    ``base`` is the name of the base in the scene, ``times`` (K,), s, are those of the frames.
    """
    flown, moves = described_actuators(log), list[Move]()
    if not (flown.wheel_count or flown.thruster_count):
        return moves
    frames, surface = ActuatorFrames.of(log, flown, times), BaseSurface(robot)
    size = surface.size
    if flown.wheel_count:
        axes, mesh = flown.wheels.unit_axes, wheel(RADIUS * size, WIDTH * size)
        places = wheel_places(surface, robot.com[0], axes)
        for number, turn in enumerate(turns_from_z(axes)):
            path = f"{base}/wheel_{number + 1}"
            scene.add_frame(path, show_axes=False, position=places[number], wxyz=turn)
            rotor = scene.add_mesh_simple(
                f"{path}/rotor", *mesh, color=rgb(COLOUR), flat_shading=True
            )
            moves.append(_turning(rotor, frames.angles[:, number], frames.is_saturated[:, number]))
    if flown.thruster_count:
        throat, opening, length = (share * size for share in NOZZLE)
        nozzle, plume = cone(throat, opening, length), plume_glb(size, dark)
        places = robot.com[0] + flown.thrusters.places
        unlit: Any = {"cast_shadow": False, "receive_shadow": False, "visible": False}
        step = SHORTEST * float(flown.thrusters.values("force").max())
        for number, turn in enumerate(turns_from_z(-flown.thrusters.unit_directions)):
            path, place = f"{base}/thruster_{number + 1}", places[number]
            _add_strut(scene, f"{path}_strut", surface.nearest(place), place, size)
            scene.add_frame(path, show_axes=False, position=place, wxyz=turn)
            scene.add_mesh_simple(f"{path}/nozzle", *nozzle, color=METAL, flat_shading=False)
            light = scene.add_glb(f"{path}/plume", plume, position=(0.0, 0.0, length), **unlit)
            moves.append(_shining(light, np.round(frames.thrusts[:, number] / step) * SHORTEST))
    return moves


def _add_strut(scene: SceneApi, path: str, start: Array, end: Array, size: float) -> None:
    """Draw what holds a nozzle that is away from the base."""
    along = end - start
    length = float(np.linalg.norm(along))
    if length > NOZZLE[1] * size:
        mesh = cone(STRUT * size, STRUT * size, length)
        turn = turns_from_z(along[np.newaxis] / length)[0]
        scene.add_mesh_simple(path, *mesh, color=METAL, position=start, wxyz=turn)


def _turning(rotor: MeshHandle, angles: Array, is_saturated: Mask) -> Move:
    turns = np.zeros((len(angles), 4))
    turns[:, 0], turns[:, 3] = np.cos(0.5 * angles), np.sin(0.5 * angles)
    turns = np.round(turns / STEP) * STEP

    def move(k: int) -> None:
        set_pose(rotor, "wxyz", turns[k])
        if is_saturated[k] != (k > 0 and is_saturated[k - 1]):
            rotor.color = rgb(SATURATED if is_saturated[k] else COLOUR)

    return move


def _shining(plume: GlbHandle, lengths: Array) -> Move:
    def move(k: int) -> None:
        length, before = float(lengths[k]), float(lengths[k - 1]) if k else 0.0
        if length not in (before, 0.0):
            plume.scale = (1.0, 1.0, length)
        if (length > 0.0) != (before > 0.0):
            plume.visible = length > 0.0

    return move


def wheel_places(surface: BaseSurface, com: Array, axes: Array) -> Array:
    """Return where wheels with these unit axes (W, 3) are drawn, (W, 3) m, base frame.

    No part of them is in the base. Wheels on a common axis through the centre of mass are one
    behind the other.
    """
    places = np.empty_like(axes)
    angles = np.linspace(0.0, 2.0 * np.pi, RIM_POINTS, endpoint=False)
    circle = np.column_stack([np.cos(angles), np.sin(angles), 0.0 * angles])
    points = np.concatenate([share * RADIUS * surface.size * circle for share in WHEEL_RINGS])
    for number, axis in enumerate(axes):
        behind = int(np.count_nonzero(np.abs(axes[:number] @ axis) > 0.99))
        turn, _ = Rotation.align_vectors([axis], [[0.0, 0.0, 1.0]])
        starts = [com, *(com + turn.apply(points))]
        away = max(surface.distance(start, axis) for start in starts)
        places[number] = com + (away + (0.6 + 1.4 * behind) * WIDTH * surface.size) * axis
    return places


def plume_glb(size: float, dark: bool) -> bytes:
    """Return a plume along z as a GLB file, for a base of a size, m: its light fades outwards."""
    along = np.linspace(0.0, 1.0, RINGS)
    radii = size * (THICK + (THIN - THICK) * along)
    colours = np.column_stack([np.tile(GLOW[dark], (RINGS, 1)), 0.95 * (1.0 - along)])
    return revolved_glb(radii, size * LENGTH * along, colours, SIDES)


def actuator_notes(log: FlightLog, times: Array) -> list[str]:
    """Say how actuators are drawn in frames at ``times`` (K,), s, a sentence each."""
    flown, notes = described_actuators(log), []
    if flown.wheel_count:
        slowdown = ActuatorFrames.of(log, flown, times).slowdown
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
