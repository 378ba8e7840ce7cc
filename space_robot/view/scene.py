"""A viser scene and a robot in it: shapes attached to moving frames of the bodies."""

from __future__ import annotations

import logging
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, unit_rows
from space_robot_model.elementary.rotations import quaternion_of_rotation
from space_robot_model.robot import Robot
from space_robot_model.robot.parts import Colour, Visual
from space_robot_model.robot.placements import (
    Transform,
    frame_names,
    joint_transforms,
    tool_transforms,
)
from space_robot_model.robot.shapes import LINK_COLOUR

from .meshes import Mesh
from .shapes import drawn_parts, shown_shapes

if TYPE_CHECKING:
    from viser import FrameHandle, SceneApi, SceneNodeHandle, ViserServer

RGB = tuple[int, int, int]

AXES = 0.08
"""Length of a tool's axes relative to that of all links."""
ON_DARK = ("#56B4E9", "#E98FC0", "#2CC295", "#E69F00", "#F0E442", "#FF7F41")
ON_WHITE = ("#0072B2", "#CC79A7", "#009E73", "#E69F00", "#8A7F00", "#D55E00")
"""Colours of Okabe and Ito, adapted to dark and light pages; flights have the first ones."""


def palette(dark: bool) -> tuple[str, ...]:
    """Return the colours of a page that is light on dark, or dark on light."""
    return ON_DARK if dark else ON_WHITE


@contextmanager
def local_server(port: int = 0) -> Iterator[ViserServer]:
    """Serve scenes to browsers of this machine, on 127.0.0.1, without output.

    If the ``port`` is in use it is the next free one; 0: any.
    """
    from rich import get_console
    from viser import ViserServer

    # an unused connection of a browser is not an error
    logging.getLogger("websockets.server").setLevel(logging.CRITICAL)
    console = get_console()
    was_quiet, console.quiet = console.quiet, True
    try:
        server = ViserServer(host="127.0.0.1", port=port, verbose=False)
        try:
            yield server
        finally:
            server.stop()
    finally:
        console.quiet = was_quiet


class SceneStyle(NamedTuple):
    """Style of a robot's shapes."""

    tint: str = ""
    """Colour of all shapes, such as ``#E69F00``; empty: their own."""
    opacity: float = 1.0
    growth: float = 0.0
    """Enlargement of shapes, m, so that overlapping robots have no coincident surfaces."""


PLAIN = SceneStyle()


class RobotScene:
    """A robot in the scene with the frames of tf, such as ``/tde_stc/base_link/link1``.

    It stands at the origin below ``root``, its name in the scene, which begins with a slash.
    """

    def __init__(self, scene: SceneApi, root: str, robot: Robot, style: SceneStyle = PLAIN) -> None:
        self._scene, self._style = scene, style
        self._names = frame_names(robot).bodies
        base = self._names[0]
        self._paths = {base: f"{root}/{_node_name(base)}"}
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
        path = f"{self._paths[link.parent]}/{_node_name(link.child)}"
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
        """Draw a shape on its body, below which its ``name`` is unique."""
        path = f"{self._paths[self._names[shape.body]]}/{name}"
        return add_shape(self._scene, path, shape, self._style, mesh)

    def move(self, position: Array, quaternion: Array, joints: Sequence[Transform], k: int) -> None:
        """Move the base to (3,) m and (4,), inertial frame, and the joints to their k-th row."""
        set_pose(self.base, "position", position)
        set_pose(self.base, "wxyz", quaternion)
        for link in joints:
            frame = self._frames[link.child]
            if len(link.quaternion) > 1:
                set_pose(frame, "wxyz", link.quaternion[k])
            if len(link.position) > 1:
                set_pose(frame, "position", link.position[k])


def set_pose(frame: SceneNodeHandle, what: str, value: Array) -> None:
    """Set a frame's ``position`` or ``wxyz`` exactly.

    viser ignores changes within the tolerance of `numpy.allclose`, 1e-5.
    """
    held = getattr(frame, what)
    if not np.array_equal(held, value):
        held[:] = np.nan
        setattr(frame, what, value)


def add_shape(
    scene: SceneApi, path: str, shape: Visual, style: SceneStyle = PLAIN, mesh: Mesh | None = None
) -> SceneNodeHandle:
    """Draw a shape as a node of the scene; ``mesh`` is its file's, if it has one."""
    colour = shape.colour or LINK_COLOUR
    pose: dict[str, Any] = {
        "position": shape.position,
        "wxyz": quaternion_of_rotation(shape.rotation),
    }
    if style == SceneStyle(opacity=style.opacity) and (parts := drawn_parts(shape)):
        nodes: list[SceneNodeHandle] = []
        for part in parts:
            name = f"{path}/{part.name}" if nodes else path
            pose |= {"color": _bytes(part.colour), "opacity": _opacity(style.opacity)}
            nodes.append(scene.add_mesh_simple(name, *part.mesh, flat_shading=True, **pose))
            pose = {}  # the others are on the first one
        return nodes[0]
    pose["color"] = rgb(style.tint) if style.tint else _bytes(colour)
    pose["opacity"] = _opacity(colour[3] * style.opacity)
    more = style.growth
    if mesh is not None:
        flips = np.prod(shape.size) < 0.0  # mirrored: faces must be reversed
        faces = mesh.faces[:, ::-1] if flips else mesh.faces
        return scene.add_mesh_simple(
            path, mesh.vertices * shape.size, faces, flat_shading=True, **pose
        )
    if shape.shape == "box":
        x, y, z = (edge + 2.0 * more for edge in shape.size)
        return scene.add_box(path, dimensions=(x, y, z), **pose)
    if shape.shape == "cylinder":
        radius, length = shape.size[0] + more, shape.size[1] + 2.0 * more
        return scene.add_cylinder(path, radius, length, **pose)
    return scene.add_icosphere(path, shape.size[0] + more, **pose)


def _bytes(colour: Colour) -> RGB:
    red, green, blue = (round(255 * value) for value in colour[:3])
    return red, green, blue


def _opacity(value: float) -> float | None:
    return value if value < 1.0 else None


def rgb(colour: str) -> RGB:
    """Return red, green and blue, from 0 to 255, of a colour such as ``#E69F00``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def turns_from_z(directions: Array) -> Array:
    """Return the shortest rotations from z to unit vectors (K, 3), (K, 4) ``[w, x, y, z]``."""
    x, y, z = directions.T
    turns = np.column_stack([1.0 + z, -y, x, np.zeros(len(z))])
    turns[z < -1.0 + 1e-12] = (0.0, 1.0, 0.0, 0.0)
    return unit_rows(turns)


def _node_name(name: str) -> str:
    """Return a name as a single component of a path in the scene."""
    return name.replace("/", "_") or "_"
