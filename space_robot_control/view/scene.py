"""The robot in a viser scene: its shapes below the frames of its bodies, which are then moved."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_sim.robot import Robot
from space_robot_sim.robot.shapes import shapes_of
from space_robot_sim.robot.transforms import Transform, joint_transforms, tool_transforms, wxyz

if TYPE_CHECKING:
    from viser import FrameHandle, SceneApi

Array = NDArray[np.float64]


class RobotScene:
    """A robot below a name of its own, as ``/tde_stc/base/joint1``: frames as tf has them."""

    def __init__(
        self, scene: SceneApi, root: str, robot: Robot, tint: tuple[int, int, int] | None = None,
        opacity: float = 1.0,
    ) -> None:  # fmt: skip
        """Add the robot; it stands at zero.

        Args:
            scene: of a server.
            root: name of the robot in the scene, beginning with a slash.
            robot: its numbers.
            tint: colour of all shapes; None: their own.
            opacity: of all shapes.
        """
        self._robot, base = robot, robot.body_names[0]
        self._path = {base: f"{root}/{base}"}
        self.base: FrameHandle = scene.add_frame(self._path[base], show_axes=False)
        self._frames: dict[str, FrameHandle] = {}
        for transform in joint_transforms(robot, np.zeros((1, robot.joint_count))):
            self._frames[transform.child] = self._add(scene, transform)
        for transform in tool_transforms(robot):
            self._add(scene, transform, show_axes=True)
        for number, shape in enumerate(shapes_of(robot)):
            name = f"{self._path[robot.body_names[shape.body]]}/shape_{number}"
            _add_shape(scene, name, shape, tint, opacity)

    def _add(self, scene: SceneApi, transform: Transform, show_axes: bool = False) -> FrameHandle:
        path = self._path[transform.child] = f"{self._path[transform.parent]}/{transform.child}"
        return scene.add_frame(
            path, show_axes=show_axes, axes_length=0.3, axes_radius=0.015,
            position=transform.position[0], wxyz=transform.quaternion[0],
        )  # fmt: skip

    def move(self, position: Array, quaternion: Array, moved: Sequence[Transform], k: int) -> None:
        """Move base and joints.

        Args:
            position: (3,) m of the base, inertial frame.
            quaternion: (4,) of the base.
            moved: of `joint_transforms`.
            k: which of their rows.
        """
        self.base.position, self.base.wxyz = position, quaternion
        for transform in moved:
            frame = self._frames[transform.child]
            if len(transform.quaternion) > 1:
                frame.wxyz = transform.quaternion[k]
            if len(transform.position) > 1:
                frame.position = transform.position[k]


def _add_shape(scene, name, shape, tint, opacity):  # type: ignore[no-untyped-def]
    colour = shape.colour or (0.7, 0.7, 0.7, 1.0)
    rgb = tint or tuple(round(255 * c) for c in colour[:3])
    common = {
        "color": rgb, "position": shape.position, "wxyz": wxyz(shape.rotation),
        "opacity": opacity if opacity < 1.0 else None,
    }  # fmt: skip
    if shape.shape == "box":
        scene.add_box(name, dimensions=shape.size, **common)
    elif shape.shape == "cylinder":
        scene.add_cylinder(name, radius=shape.size[0], height=shape.size[1], **common)
    elif shape.shape == "sphere":
        scene.add_icosphere(name, radius=shape.size[0], **common)
