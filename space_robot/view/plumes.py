"""Plumes of thrusters in a scene, as long as the recorded thrust is large."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import ThrusterSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

from .arrows import turns_from_z
from .base_surface import base_size, nearest_on_surface
from .frames import frame_rows
from .glb import grid_faces, unlit_glb
from .solids import cone

if TYPE_CHECKING:
    from viser import GlbHandle, SceneApi

    from .scene import RobotScene

Array = NDArray[np.float64]

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


class PlumeFrames(NamedTuple):
    """Thrust of T thrusters at K times."""

    thrusts: Array
    """(K, T) mean thrust since the frame before, N."""

    @classmethod
    def of(cls, log: FlightLog, times: Array) -> PlumeFrames:
        """Average the recorded thrusts, which are means over the intervals that end at ticks.

        Args:
            log: the flight.
            times: (K,) of the frames, s.
        """
        rows = frame_rows(log, times)
        sums = np.zeros((log.ticks + 1, log.thrusts.shape[1]))
        np.cumsum(np.nan_to_num(log.thrusts), axis=0, out=sums[1:])
        starts = np.concatenate([rows[:1], rows[:-1] + 1])  # a frame after the end holds the last
        starts = np.minimum(starts, rows)
        counts = (rows + 1 - starts)[:, np.newaxis]
        return cls((sums[rows + 1] - sums[starts]) / counts)


class DrawnPlumes:
    """The thrusters on a robot's base."""

    def __init__(
        self,
        scene: SceneApi,
        robot_scene: RobotScene,
        robot: Robot,
        thrusters: ThrusterSettings,
        dark: bool,
    ) -> None:
        """Draw nozzles, and plumes of no length.

        Args:
            scene: of a server.
            robot_scene: the robot in it.
            robot: that carries them.
            thrusters: of its base.
            dark: whether the page is light on dark.
        """
        size = base_size(robot)
        self._largest = float(thrusters.values("force").max(initial=0.0))
        self._plumes: list[GlbHandle] = []
        self._lengths = np.zeros(thrusters.count)
        throat, exit_radius, length = (share * size for share in NOZZLE)
        nozzle = cone(throat, exit_radius, length)
        plume = plume_glb(THICK * size, THIN * size, LENGTH * size, dark)
        away = turns_from_z(-thrusters.unit_directions)
        for number, place in enumerate(robot.com[0] + thrusters.places):
            path = f"{robot_scene.base.name}/thruster_{number + 1}"
            scene.add_frame(path, show_axes=False, position=place, wxyz=away[number])
            scene.add_mesh_simple(f"{path}/nozzle", *nozzle, color=METAL, flat_shading=False)
            _add_strut(scene, f"{path}_strut", nearest_on_surface(robot, place), place, size)
            self._plumes.append(
                scene.add_glb(
                    f"{path}/plume",
                    plume,
                    position=(0.0, 0.0, length),
                    cast_shadow=False,
                    receive_shadow=False,
                    visible=False,
                )
            )

    def move(self, thrusts: Array) -> None:
        """Set the lengths of the plumes, in proportion to the thrusts (T,), N."""
        shares = np.round(thrusts / (self._largest * SHORTEST)) * SHORTEST
        for number, (plume, share) in enumerate(zip(self._plumes, shares.tolist(), strict=True)):
            if share == self._lengths[number]:
                continue
            if share > 0.0:
                plume.scale = (1.0, 1.0, share)
            if (share > 0.0) != (self._lengths[number] > 0.0):
                plume.visible = share > 0.0
            self._lengths[number] = share


def plume_glb(start: float, end: float, length: float, dark: bool) -> bytes:
    """Return a plume along z as a GLB file: its light fades with the distance.

    Args:
        start: radius at the nozzle, m.
        end: radius at the other end, m.
        length: m.
        dark: whether the page is light on dark.
    """
    along = np.linspace(0.0, 1.0, RINGS)
    angles = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    around = np.column_stack([np.cos(angles), np.sin(angles), np.zeros(SIDES)])
    radii = start + (end - start) * along
    rings = radii[:, np.newaxis, np.newaxis] * around
    rings[..., 2] = length * along[:, np.newaxis]
    shades = np.empty((RINGS, SIDES, 4))
    shades[..., :3] = GLOW[dark]
    shades[..., 3] = (0.95 * (1.0 - along))[:, np.newaxis]
    faces = grid_faces(RINGS, SIDES)[:, ::-1]
    no_lines = np.empty((0, 2), np.int64)
    return unlit_glb(rings.reshape(-1, 3), shades.reshape(-1, 4), faces, no_lines)


def _add_strut(scene: SceneApi, path: str, start: Array, end: Array, size: float) -> None:
    """Draw what holds a nozzle that is away from the base."""
    along = end - start
    length = float(np.linalg.norm(along))
    if length > NOZZLE[1] * size:
        mesh = cone(STRUT * size, STRUT * size, length)
        turn = turns_from_z(along[np.newaxis] / length)[0]
        scene.add_mesh_simple(path, *mesh, color=METAL, position=start, wxyz=turn)
