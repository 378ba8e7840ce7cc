"""Arrows at the base of a robot in orbit: to the Earth's centre, along the orbit, to the Sun."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import unit_rows
from space_robot_model.robot import Robot

from .frames import rounded
from .glb import grid_faces, unlit_glb
from .palette import NADIR, SUN, VELOCITY, palette
from .scene import rgb, set_pose
from .stage import body_reach

if TYPE_CHECKING:
    from viser import SceneApi

Array = NDArray[np.float64]

BEYOND = 0.16
"""Length of arrows beyond the base, relative to the size of the robot."""
SHAFT, HEAD, TIP = 0.004, 0.012, 0.036
"""Radius of the shaft, and radius and length of the head, relative to the size of the robot."""
SIDES = 16


class ArrowKind(NamedTuple):
    """A direction that is shown."""

    name: str
    colour: str
    """Such as ``#E69F00``."""


def arrow_kinds(has_sun: bool, dark: bool) -> list[ArrowKind]:
    """Return nadir, orbital velocity and, if it is known, the Sun.

    Args:
        has_sun: whether the direction of the Sun is known.
        dark: whether the page is light on dark.
    """
    colours = palette(dark)
    kinds = [
        ArrowKind("nadir", colours[NADIR]),
        ArrowKind("orbital velocity", colours[VELOCITY]),
        ArrowKind("Sun", colours[SUN]),
    ]
    return kinds if has_sun else kinds[:2]


def arrow_directions(position: Array, velocity: Array, sun: Array | None) -> Array:
    """Return the unit vectors (A, 3) of the arrows, in the order of `arrow_kinds`.

    Args:
        position: (3,) of the robot from the Earth's centre.
        velocity: (3,) of the same.
        sun: (3,) towards the Sun; None: unknown.
    """
    return unit_rows(np.array([-position, velocity, *([] if sun is None else [sun])]))


class ArrowSize(NamedTuple):
    """Size of the arrows of a robot."""

    length: float
    """From the base's frame to the tip, m."""
    size: float
    """Of the robot, m."""

    @classmethod
    def of(cls, robot: Robot, seen: Array) -> ArrowSize:
        """Return the size for a robot that has been at some points, (K, 3) m."""
        size = float(np.ptp(seen, axis=0).max())
        return cls(body_reach(robot, 0) + BEYOND * size, size)


class BaseArrows:
    """Arrows at the base of a robot in orbit."""

    def __init__(
        self, scene: SceneApi, root: str, size: ArrowSize, kinds: Sequence[ArrowKind]
    ) -> None:
        """Draw them.

        Args:
            scene: of a server.
            root: name of the robot in the scene.
            size: of the arrows.
            kinds: from `arrow_kinds`.
        """
        self._base = scene.add_frame(f"{root}/orbit", show_axes=False)
        self._nodes = []
        for kind in kinds:
            path = f"{root}/orbit/{kind.name.replace(' ', '_')}"
            self._nodes.append(scene.add_frame(path, show_axes=False))
            scene.add_glb(
                f"{path}/arrow",
                arrow_glb(size, rgb(kind.colour)),
                cast_shadow=False,
                receive_shadow=False,
            )
            end = size.length + 0.5 * HEAD * size.size
            scene.add_label(f"{path}/label", kind.name, position=(0.0, 0.0, end))

    def move(self, base: Array, directions: Array) -> None:
        """Move them.

        Args:
            base: (3,) position of the base, m, inertial frame.
            directions: from `arrow_directions`.
        """
        set_pose(self._base, "position", base)
        for node, turn in zip(self._nodes, rounded(turns_from_z(directions)), strict=True):
            set_pose(node, "wxyz", turn)


def arrow_glb(size: ArrowSize, colour: tuple[int, int, int]) -> bytes:
    """Return an arrow along z as a GLB file: light does not change the colour of the legend."""
    length, neck = size.length, size.length - TIP * size.size
    radii = np.array([0.0, SHAFT, SHAFT, HEAD, 0.0]) * size.size
    heights = np.array([0.0, 0.0, neck, neck, length])
    angles = np.arange(SIDES) * (2.0 * np.pi / SIDES)
    around = np.column_stack([np.cos(angles), np.sin(angles)])
    rings = np.empty((len(radii), SIDES, 3))
    rings[..., :2] = radii[:, np.newaxis, np.newaxis] * around
    rings[..., 2] = heights[:, np.newaxis]
    vertices = rings.reshape(-1, 3)
    faces = grid_faces(len(radii), SIDES)[:, ::-1]
    colours = np.tile(np.array(colour) / 255.0, (len(vertices), 1))
    return unlit_glb(vertices, colours, faces, np.empty((0, 2), np.int64))


def turns_from_z(directions: Array) -> Array:
    """Return the shortest rotations from z to unit vectors (K, 3), (K, 4) ``[w, x, y, z]``."""
    x, y, z = directions.T
    turns = np.column_stack([1.0 + z, -y, x, np.zeros(len(z))])
    turns[z < -1.0 + 1e-12] = (0.0, 1.0, 0.0, 0.0)
    return unit_rows(turns)
