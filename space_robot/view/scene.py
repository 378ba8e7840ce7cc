"""The robot in a viser scene: shapes attached to moving frames of the bodies."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Visual
from space_robot_model.robot.placements import (
    Transform,
    frame_names,
    joint_transforms,
    tool_transforms,
)

from .mesh import Mesh
from .meshes import shown_shapes
from .spacecraft import ShapePart, parts_of

if TYPE_CHECKING:
    from viser import FrameHandle, SceneApi, SceneNodeHandle

Array = NDArray[np.float64]

AXES = 0.08
"""Length of a tool's axes relative to that of all links."""
GREY = (0.7, 0.7, 0.7, 1.0)
"""Colour of shapes without a colour."""


class SceneStyle(NamedTuple):
    """Style of a robot's shapes."""

    tint: str = ""
    """Colour of all shapes, such as ``#E69F00``; empty: their own."""
    opacity: float = 1.0
    growth: float = 0.0
    """Enlargement of shapes, m, so that overlapping robots have no coincident surfaces."""


class RobotScene:
    """A robot in the scene with the frames of tf, such as ``/tde_stc/base_link/link1``."""

    def __init__(
        self, scene: SceneApi, root: str, robot: Robot, look: SceneStyle | None = None
    ) -> None:
        """Add the robot at the origin.

        Args:
            scene: of a server.
            root: name of the robot in the scene, beginning with a slash.
            robot: to be drawn.
            look: style of its shapes.
        """
        self._scene, self._robot, self._look = scene, robot, look or SceneStyle()
        self._names = frame_names(robot).bodies
        base = self._names[0]
        self._paths = {base: f"{root}/{_part(base)}"}
        self.base: FrameHandle = scene.add_frame(self._paths[base], show_axes=False)
        self._frames: dict[str, FrameHandle] = {}
        links = joint_transforms(robot, np.zeros((1, robot.joint_count)))
        axes = AXES * sum(float(np.linalg.norm(link.position)) for link in links)
        for link in links:
            self._frames[link.child] = self._add_frame(link)
        for tool in tool_transforms(robot):
            self._add_frame(tool, axes)
        drawn = shown_shapes(robot)
        for number, shape in enumerate(drawn.shapes):
            self.add_shape(f"shape_{number}", shape, drawn.meshes.get(shape.mesh))

    def _add_frame(self, link: Transform, axes: float = 0.0) -> FrameHandle:
        path = f"{self._paths[link.parent]}/{_part(link.child)}"
        while path in self._paths.values():  # a tool may have the name of a body
            path += "_"
        self._paths.setdefault(link.child, path)
        return self._scene.add_frame(
            path,
            show_axes=axes > 0.0,
            axes_length=axes,
            axes_radius=0.04 * axes,
            position=link.position[0],
            wxyz=link.quaternion[0],
        )

    def add_shape(self, name: str, shape: Visual, mesh: Mesh | None = None) -> SceneNodeHandle:
        """Draw a shape on its body.

        Args:
            name: of the shape, unique on the body.
            shape: to be drawn.
            mesh: if the shape is a mesh.
        """
        path = f"{self._paths[self._names[shape.body]]}/{name}"
        return add_shape(self._scene, path, shape, self._look, mesh)

    def move(self, position: Array, quaternion: Array, moved: Sequence[Transform], k: int) -> None:
        """Move base and joints.

        Args:
            position: (3,) of the base, m, inertial frame.
            quaternion: (4,) of the base.
            moved: transforms from `joint_transforms`.
            k: row of the transforms.
        """
        set_pose(self.base, "position", position)
        set_pose(self.base, "wxyz", quaternion)
        for link in moved:
            frame = self._frames[link.child]
            if len(link.quaternion) > 1:
                set_pose(frame, "wxyz", link.quaternion[k])
            if len(link.position) > 1:
                set_pose(frame, "position", link.position[k])


def set_pose(frame: SceneNodeHandle, what: str, value: Array) -> None:
    """Set a frame's pose exactly.

    viser ignores changes within the tolerance of `numpy.allclose`, 1e-5.
    """
    held = getattr(frame, what)
    if not np.array_equal(held, value):
        held[:] = np.nan
        setattr(frame, what, value)


def add_shape(
    scene: SceneApi, path: str, shape: Visual, look: SceneStyle, mesh: Mesh | None = None
) -> SceneNodeHandle:
    """Draw a shape below a node of the scene.

    Args:
        scene: of a server.
        path: of the shape in the scene.
        shape: to be drawn; its body is not used.
        look: style of the shape.
        mesh: if the shape is a mesh.
    """
    *own, alpha = shape.colour or GREY
    red, green, blue = (round(255 * value) for value in own)
    colour = rgb(look.tint) if look.tint else (red, green, blue)
    opacity = alpha * look.opacity if alpha * look.opacity < 1.0 else None
    position, turn, more = shape.position, quaternion_of_rotation(shape.rotation), look.growth
    if not look.tint and not look.growth and (parts := parts_of(shape)):
        first, *others = parts
        node = _add_part(scene, path, first, look, position, turn)
        for part in others:
            _add_part(scene, f"{path}/{part.name}", part, look)
        return node
    if mesh is not None:
        vertices = mesh.vertices * shape.size
        flips = np.prod(shape.size) < 0.0  # mirrored: faces must be reversed
        return scene.add_mesh_simple(
            path,
            vertices,
            mesh.faces[:, ::-1] if flips else mesh.faces,
            color=colour,
            opacity=opacity,
            flat_shading=True,
            position=position,
            wxyz=turn,
        )
    if shape.shape == "box":
        x, y, z = (edge + 2.0 * more for edge in shape.size)
        return scene.add_box(path, colour, (x, y, z), opacity=opacity, position=position, wxyz=turn)
    if shape.shape == "cylinder":
        radius, length = shape.size[0] + more, shape.size[1] + 2.0 * more
        return scene.add_cylinder(
            path, radius, length, colour, opacity=opacity, position=position, wxyz=turn
        )
    return scene.add_icosphere(
        path, shape.size[0] + more, colour, opacity=opacity, position=position, wxyz=turn
    )


def _add_part(
    scene: SceneApi,
    path: str,
    part: ShapePart,
    look: SceneStyle,
    position: Array | tuple[float, float, float] = (0.0, 0.0, 0.0),
    turn: Array | tuple[float, float, float, float] = (1.0, 0.0, 0.0, 0.0),
) -> SceneNodeHandle:
    red, green, blue, _ = (round(255 * value) for value in part.colour)
    return scene.add_mesh_simple(
        path,
        *part.mesh,
        color=(red, green, blue),
        opacity=look.opacity if look.opacity < 1.0 else None,
        flat_shading=True,
        position=position,
        wxyz=turn,
    )


def rgb(colour: str) -> tuple[int, int, int]:
    """Return red, green and blue, from 0 to 255, of a colour such as ``#E69F00``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def _part(name: str) -> str:
    """Return a name as a single component of a path in the scene."""
    return name.replace("/", "_") or "_"
