"""Frames of a robot's bodies and tools: names and places, in a flight, for tf and for views."""

from __future__ import annotations

from collections.abc import Iterator
from typing import NamedTuple

import numpy as np

from space_robot_msgs_py.samples import RobotState
from space_robot_msgs_py.topics import BASE_FRAME, INERTIAL_FRAME
from space_robot_msgs_py.wire.viewers import POSE, FramePair

from ..elementary.functions import sines_cosines
from ..elementary.matrices import Array
from ..elementary.rotations import quaternion_of_rotation
from .names import BASE
from .robot import Robot

XYZW = [1, 2, 3, 0]
"""Indices that bring a quaternion ``[w, x, y, z]`` into ROS's order."""
WXYZ = [3, 0, 1, 2]
"""The inverse of `XYZW`."""
BATCH = 8192
"""Rows per batch, so that all vectors of a batch fit into the processor's cache."""


def base_axes(quaternion: Array) -> Array:
    """Return the base's axes x, y, z in inertial axes, (3, 3, N), of (4, N) ``[w, x, y, z]``."""
    w, x, y, z = quaternion
    return np.array(
        [
            [1.0 - 2.0 * (y * y + z * z), 2.0 * (x * y + w * z), 2.0 * (x * z - w * y)],
            [2.0 * (x * y - w * z), 1.0 - 2.0 * (x * x + z * z), 2.0 * (y * z + w * x)],
            [2.0 * (x * z + w * y), 2.0 * (y * z - w * x), 1.0 - 2.0 * (x * x + y * y)],
        ]
    )


def to_inertial(axes: Array, vectors: Array) -> Array:
    """Rotate vectors (3, N) from base to inertial axes, (3, N); ``axes`` of `base_axes`."""
    turned: Array = axes[0] * vectors[0] + axes[1] * vectors[1] + axes[2] * vectors[2]
    return turned


def to_base(axes: Array, vectors: Array) -> Array:
    """Rotate vectors (3, N) from inertial to base axes, (3, N); ``axes`` of `base_axes`."""
    turned: Array = axes[:, 0] * vectors[0] + axes[:, 1] * vectors[1] + axes[:, 2] * vectors[2]
    return turned


def cross(a: Array, b: Array) -> Array:
    """Return ``a x b`` of vectors (3, N), faster than NumPy for short rows."""
    return np.array(
        [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
    )


class BodyFrame(NamedTuple):
    """Frame of a body at T ticks; vectors (3, T) in the axes of an outer frame."""

    body: int
    x: Array
    y: Array
    z: Array
    """Axis of the joint that moves the body."""
    origin: Array
    """Position relative to the base's CoM, m."""

    def on_outer_axes(self, vector: Array) -> Array:
        """Rotate a vector (3,) from the body's axes to the outer frame's, (3, T)."""
        turned: Array = self.x * vector[0] + self.y * vector[1] + self.z * vector[2]
        return turned


def body_frames(robot: Robot, axes: Array, joint_positions: Array) -> Iterator[BodyFrame]:
    """Yield the frame of the base, then of every body, parents before children.

    Args:
        robot: its masses are not used.
        axes: (3, 3, T) of the base, those of `base_axes` for an inertial outer frame.
        joint_positions: (N, T) of all joints, rad, or m for prismatic ones.
    """
    frames = {0: BodyFrame(0, axes[0], axes[1], axes[2], np.zeros_like(axes[0]))}
    yield frames[0]
    for joint in robot.order:
        _, x, y, z, origin = frames[int(robot.parent[joint])]
        turn, offset, position = robot.rotation[joint], robot.offset[joint], joint_positions[joint]
        x, y, z = (_combined((x, y, z), turn[:, k]) for k in range(3))
        origin = origin + _combined((x, y, z), offset)
        if robot.is_prismatic[joint]:
            origin = origin + position * z
        else:
            st, ct = sines_cosines(position)
            x, y = ct * x + st * y, ct * y - st * x
        frames[joint + 1] = BodyFrame(joint + 1, x, y, z, origin)
        yield frames[joint + 1]


def _combined(vectors: tuple[Array, Array, Array], factors: Array) -> Array:
    # most factors are zero or one, and rows are long: zeros are skipped
    terms = [
        factor * vector for factor, vector in zip(factors, vectors, strict=True) if factor != 0.0
    ]
    total = terms[0] if terms else np.zeros_like(vectors[0])
    for term in terms[1:]:
        total = total + term
    return total


def tool_pose(robot: Robot, quaternion: Array, joint_positions: Array) -> tuple[Array, Array]:
    """Return rotation and position of the end effector's frame, relative to the base's.

    Args:
        robot: its masses are not used.
        quaternion: (N, 4) unit quaternion ``[w, x, y, z]`` of the base.
        joint_positions: (N, J) of all joints, passive ones last; rad, or m for prismatic ones.

    Returns:
        (N, 3, 3) rotation from the tool's frame to the inertial one; (N, 3) position, m, inertial
        axes.
    """
    rows = len(quaternion)
    rotation, position = np.empty((rows, 3, 3)), np.empty((rows, 3))
    tool = robot.tool
    for start in range(0, rows, BATCH):
        part = slice(start, start + BATCH)
        frames = body_frames(robot, base_axes(quaternion[part].T), joint_positions[part].T)
        carrier = next(frame for frame in frames if frame.body == tool.body)
        for k in range(3):
            rotation[part, :, k] = carrier.on_outer_axes(tool.rotation[:, k]).T
        position[part] = (carrier.origin + carrier.on_outer_axes(tool.position)).T
    return rotation, position


class FrameNames(NamedTuple):
    """Names of the frames of all bodies, the base first, and of all tools."""

    bodies: tuple[str, ...]
    tools: tuple[str, ...]


def frame_names(robot: Robot) -> FrameNames:
    """Return the frame names of bodies and tools, following the conventions of ROS.

    The base of a YAML file is ``base_link`` (REP 105); that of a URDF keeps its name. A body with
    the name of a joint, as in YAML files, becomes a link: ``link1`` for ``joint1``, ``elbow_link``
    for ``elbow``. A tool with the name of a body, such as a URDF's last link, becomes
    ``<name>_tool``. No frame has the name of the inertial frame or of a joint, starts with a slash,
    or contains characters that are invalid in XML.
    """
    joints = set(urdf_joint_names(robot))
    taken = {INERTIAL_FRAME, *joints}
    base, *links = robot.body_names
    names = {0: distinct(BASE_FRAME if base == BASE else base, "_body", taken)}
    clashes = [plain_name(link) in joints for link in links]
    for is_changed in (False, True):  # unchanged names have priority
        for number, link in enumerate(links, 1):
            if clashes[number - 1] is is_changed:
                names[number] = distinct(_link_name(link) if is_changed else link, "_body", taken)
    bodies = tuple(names[number] for number in range(len(names)))
    return FrameNames(bodies, tuple(distinct(tool.name, "_tool", taken) for tool in robot.tools))


def urdf_joint_names(robot: Robot) -> list[str]:
    """Return the names of the joints, changed only if two are equal in XML."""
    taken: set[str] = set()
    return [distinct(joint, "_", taken) for joint in robot.all_joint_names]


def _link_name(name: str) -> str:
    for joint, link in (("joint", "link"), ("Joint", "Link"), ("JOINT", "LINK")):
        if joint in name:
            return name.replace(joint, link)
    return f"{name}_link"


def distinct(name: str, ending: str, taken: set[str]) -> str:
    """Return an unused name, with a suffix if necessary, and add it to ``taken``."""
    candidate = plain_name(name)
    number = 1
    while candidate in taken:
        candidate = f"{plain_name(name)}{ending}{number if number > 1 else ''}"
        number += 1
    taken.add(candidate)
    return candidate


def plain_name(name: str) -> str:
    """Return a name as one line, without slashes or spaces at its ends."""
    shown = "".join(letter if letter.isprintable() else "_" for letter in name)
    return shown.strip().lstrip("/") or "_"


class RobotPoses:
    """Poses of the base in the inertial frame, then of each body relative to its parent."""

    def __init__(self, robot: Robot) -> None:
        """Compute the poses at joint positions zero."""
        names, order = frame_names(robot).bodies, np.array(robot.order, np.intp)
        self.frames = (
            FramePair(INERTIAL_FRAME, names[0]),
            *(FramePair(names[robot.parent[joint]], names[joint + 1]) for joint in order),
        )
        """Frames in the order of the poses."""
        self._at_zero = np.zeros((1 + len(order), POSE))
        for row, joint in enumerate(order, 1):
            self._at_zero[row] = _pose(
                robot.rotation[joint], robot.rotation[joint] @ robot.offset[joint]
            )
        self.slides = np.append(False, robot.is_prismatic[order])
        """Whether a pose is that of a body on a prismatic joint."""
        self._sliding, self._turning = order[self.slides[1:]], order[~self.slides[1:]]
        self._slid, self._turned = np.flatnonzero(self.slides), 1 + np.flatnonzero(~self.slides[1:])
        self._axes = robot.rotation[self._sliding][:, :, 2]
        # a turn about z only mixes x with y and z with w, so two products make the quaternion
        x, y, z, w = self._at_zero[self._turned, 3:].T
        # factors of the cosine and of the sine in q0 (cos theta/2, 0, 0, sin theta/2)
        self._even, self._odd = np.column_stack((x, y, z, w)), np.column_stack((y, -x, w, -z))

    def at(self, state: RobotState) -> Array:
        """Return translations, m, and quaternions x, y, z, w, (M, 7)."""
        joints = np.append(state.joint_positions, state.passive_positions)
        poses: Array = self.along(joints[np.newaxis])[0]
        poses[0, :3], poses[0, 3:] = state.base_position, state.quaternion[XYZW]
        return poses

    def along(self, joint_positions: Array) -> Array:
        """Return the poses (T, M, 7) for joint positions (T, N); that of the base is zero."""
        poses = np.tile(self._at_zero, (len(joint_positions), 1, 1))
        s, c = sines_cosines(0.5 * joint_positions[:, self._turning, np.newaxis])
        poses[:, self._turned, 3:] = c * self._even + s * self._odd
        poses[:, self._slid, :3] += joint_positions[:, self._sliding, np.newaxis] * self._axes
        return poses


class Transform(NamedTuple):
    """Pose of a frame relative to its parent's, at T ticks."""

    parent: str
    child: str
    position: Array
    """(T, 3) position, m, or (1, 3) if constant."""
    quaternion: Array
    """(T, 4) ``[w, x, y, z]`` from child to parent axes, or (1, 4) if constant."""


def joint_transforms(robot: Robot, joint_positions: Array) -> list[Transform]:
    """Return the transform of every joint, parents before children.

    Args:
        robot: with frames named by `frame_names`.
        joint_positions: (T, N) of all joints, passive ones last; rad, or m for prismatic ones.
    """
    poses = RobotPoses(robot)
    values = poses.along(joint_positions)
    positions, quaternions = values[:, :, :3], values[:, :, 3:][:, :, WXYZ]
    return [
        Transform(
            *poses.frames[row],
            positions[:, row] if poses.slides[row] else positions[:1, row],
            quaternions[:1, row] if poses.slides[row] else quaternions[:, row],
        )
        for row in range(1, len(poses.frames))
    ]


def tool_transforms(robot: Robot) -> list[Transform]:
    """Return the fixed transforms of the tools."""
    names = frame_names(robot)
    return [
        Transform(
            names.bodies[tool.body],
            name,
            tool.position[None],
            quaternion_of_rotation(tool.rotation)[None],
        )
        for tool, name in zip(robot.tools, names.tools, strict=True)
    ]


def tool_poses(robot: Robot) -> tuple[tuple[FramePair, ...], Array]:
    """Return the tools' frames and their constant poses (M, 7)."""
    poses = [_pose(tool.rotation, tool.position) for tool in robot.tools]
    frames = (FramePair(tool.parent, tool.child) for tool in tool_transforms(robot))
    return tuple(frames), np.array(poses).reshape(-1, POSE)


def _pose(rotation: Array, position: Array) -> Array:
    return np.append(position, quaternion_of_rotation(rotation)[XYZW])
