"""The robot as data from YAML or URDF, checked for physical consistency."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.config.arguments import as_numbers, as_path
from space_robot_msgs_py.config.validation import read_yaml, short, validate
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..dynamics.model import Model
from ..elementary.matrices import product
from ..elementary.rotations import plain_sin_cos
from .file import _RobotDocument
from .inertia import inertia_elements, inertia_tensor
from .numbers import Document, are_numbers, numbers_of
from .tree import Joint, Spring, TreeArrays

if TYPE_CHECKING:
    from .urdf import UrdfRobot

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Robot(TreeArrays):
    """A satellite base with arms, panels and booms: a tree of bodies, from a file or a program."""

    repairs: tuple[str, ...] = ()
    """Repairs of defects in its file, a line each."""
    source: str = ""
    """Name of its file, for errors; empty: it was made by a program."""

    @property
    def where(self) -> str:
        """Its file for errors, or its name."""
        return self.source or f"robot {self.name!r}"

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the n+3 controlled coordinates: base x, y, z, then the actuated joints."""
        return BASE_AXES + self.joint_names

    @classmethod
    def from_yaml(cls, path: str | Path) -> Robot:
        """Read and check a robot file.

        Raises:
            InputError: invalid file; names file, key, value and allowed values.
        """
        file = as_path(path, "path")
        return cls.from_dict(read_yaml(file), str(file), file.parent)

    @classmethod
    def from_dict(
        cls, content: dict[str, Any], where: str = "robot", folder: Path | None = None
    ) -> Robot:
        """Build a robot from the mapping of a file (with the key ``robot``), or from `content`.

        Args:
            content: the mapping.
            where: name of the source, for errors.
            folder: of a URDF that it refers to; None: the working folder.

        Raises:
            InputError: invalid content; names ``where``, key, value and allowed values.
        """
        from .urdf_file import is_urdf, read_urdf_content

        if not isinstance(content, dict):
            raise InputError(f"{where}: a mapping was expected, got {short(content)}")
        if is_urdf(content):
            return cls._of_urdf(read_urdf_content(content, folder or Path(), where), where)
        if are_numbers(content):
            numbers = validate(Document, content, where).robot
            bodies = [b.body for b in numbers.bodies]
            robot = cls.of_tree(numbers.name, bodies, where, base_is_at_com=False)  # bit for bit
        else:
            file = validate(_RobotDocument, content, where).robot
            robot = cls.of_tree(file.name, file.bodies(), where)
        return replace(robot, source=where)

    @classmethod
    def from_urdf(cls, path: str | Path, base: str | None = None, repair: bool = False) -> Robot:
        """Read and check a URDF, or a xacro file if that package is installed.

        Args:
            path: of the file.
            base: the link that is the satellite; the root if None.
            repair: repair defects where possible, and list them in `repairs`.

        Raises:
            InputError: invalid file; names link or joint, line, value and the repair, if any.
        """
        from .urdf import read_urdf

        file = as_path(path, "path")
        return cls._of_urdf(read_urdf(file, base, repair), str(file))

    @classmethod
    def _of_urdf(cls, urdf: UrdfRobot, where: str) -> Robot:
        robot = cls.of_tree(urdf.name, urdf.bodies, where)
        return replace(robot, repairs=tuple(map(str, urdf.findings)), source=where)

    def _repr_html_(self) -> str:
        """Show bodies, joints and limits in a notebook."""
        from .html import robot_html

        return robot_html(self)

    @property
    def content(self) -> dict[str, Any]:
        """All numbers and shapes, as lists and texts; `from_dict` builds the same robot."""
        return numbers_of(self.name, self.bodies())

    @cached_property
    def nominal(self) -> Robot:
        """The robot assumed by the flight software: passive joints locked at rest.

        Its base has the frame of this robot's base, which measurements and goals refer to, and so
        its centre of mass elsewhere if a locked panel is part of it.
        """
        if not self.springs:
            return self
        bodies = self.bodies()
        for number, body in enumerate(bodies):
            if body.joint and body.joint.spring:
                bodies[number] = replace(body, joint=_locked(body.joint, body.joint.spring.rest))
        # the same order of the actuated joints
        return Robot.of_tree(self.name, bodies, base_is_at_com=False)

    def with_springs(self, springs: Mapping[str, Spring]) -> Robot:
        """Return the robot with springs instead of motors in those of its joints that are named.

        Raises:
            InputError: no joint with a motor is left.
        """
        if not springs:
            return self
        bodies = [
            replace(body, joint=replace(body.joint, spring=springs[body.joint.name], gear=None))
            if body.joint and body.joint.name in springs
            else body
            for body in self.bodies()
        ]
        return replace(Robot.of_tree(self.name, bodies, self.where), source=self.source)

    def from_degrees(self, values: ArrayLike) -> Array:
        """Convert positions of the n actuated joints to rad; m of prismatic joints are kept.

        Args:
            values: (..., n) in degrees, or m for prismatic joints.

        Raises:
            InputError: not numbers, or not n.
        """
        numbers, n = self._of_joints(values), self.n
        return np.where(self.is_prismatic[:n], numbers, np.radians(numbers))

    def to_degrees(self, values: ArrayLike) -> Array:
        """Convert positions (..., n) in rad to degrees; m of prismatic joints are kept."""
        numbers, n = self._of_joints(values), self.n
        return np.where(self.is_prismatic[:n], numbers, np.degrees(numbers))

    def _of_joints(self, values: ArrayLike) -> Array:
        numbers = as_numbers(values, "values")
        if numbers.shape[-1:] != (self.n,):
            raise InputError(
                f"values: {self.n} numbers were expected, one per joint, "
                f"got an array of shape {numbers.shape}"
            )
        return numbers

    @cached_property
    def model_rows(self) -> tuple[int, ...]:
        """Row in `model` of each joint, see `Model.row`."""
        return tuple(int(row) for row in self.model.row[: self.joint_count])

    def tool_jacobian(
        self,
        joint_positions: ArrayLike,
        quaternion_wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0),
        attitude: Literal["held", "free"] = "held",
        tool: str | None = None,
    ) -> Array:
        """Return the Jacobian (6, N) of a tool by joint velocities, with zero linear momentum.

        Rows are the tool's velocity (m/s) and angular velocity (rad/s) on inertial axes. See
        `space_robot_model.robot.kinematics.tool_jacobian`.

        Args:
            joint_positions: (N,) of all joints, rad, or m of prismatic ones.
            quaternion_wxyz: (4,) base attitude, unit.
            attitude: "held": the base does not turn; "free": angular momentum is zero, too.
            tool: name of one of `tools`; None: the first.

        Raises:
            InputError: an argument has another type or shape, or there is no such tool.
        """
        from .kinematics import tool_jacobian

        return tool_jacobian(self, quaternion_wxyz, joint_positions, attitude, tool)

    def reaction_null_space(
        self, joint_positions: ArrayLike, quaternion_wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    ) -> Array:
        """Return a basis (N, K) of the joint velocities without angular momentum of the robot.

        Args: see `tool_jacobian`.

        Raises:
            InputError: an argument has another type or shape.
        """
        from .kinematics import reaction_null_space

        return reaction_null_space(self, quaternion_wxyz, joint_positions)

    def with_last_link(self, mass: float, inertia: list[float]) -> Robot:
        """Return the robot with mass and inertia of the body with the tool replaced, CoM kept.

        Args:
            mass: of that body, kg.
            inertia: ``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` about its CoM in its axes, kg m2.

        Raises:
            InputError: ``mass`` is not one number, or ``inertia`` not six.
        """
        for value, name, shape in ((mass, "mass", ()), (inertia, "inertia", (6,))):
            if (got := as_numbers(value, name).shape) != shape:
                raise InputError(f"{name}: shape {shape} was expected, got {got}")
        masses, tensors, last = self.mass.copy(), self.inertia.copy(), self.tool.body
        masses[last], tensors[last] = mass, inertia_tensor(inertia)
        return replace(self, mass=masses, inertia=tensors)

    @cached_property
    def model(self) -> Model:
        """The constants of the compiled algorithms."""
        return model_of(self)


def _locked(joint: Joint, position: float) -> Joint:
    """Return a fixed joint with the pose of a joint at ``position``, rad or m."""
    offset, rotation = joint.offset, joint.rotation
    if joint.kind == "prismatic":
        offset = offset + np.array([0.0, 0.0, position])
    else:
        s, c = plain_sin_cos(position)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        offset, rotation = product(turn.T, offset), product(rotation, turn)
    return Joint(joint.name, "fixed", rotation, offset)


def model_of(robot: TreeArrays) -> Model:
    """Return the `Model` of a robot, with joints in the order of visits."""
    model, count, order = Model.allocate(robot.n), robot.joint_count, list(robot.order)
    bodies = [0, *(joint + 1 for joint in order)]
    row_of_body = {body: row for row, body in enumerate(bodies)}
    assign(model, joint_count=count, actuated_count=robot.n)
    model.mass[: count + 1] = robot.mass[bodies]
    model.inertia[: count + 1] = inertia_elements(robot.inertia[bodies])
    model.com[: count + 1] = robot.com[bodies]
    model.rotation[:count] = robot.rotation[order].reshape(count, 9)
    model.offset[:count] = robot.offset[order]
    model.is_prismatic[:count] = robot.is_prismatic[order]
    for row, joint in enumerate(order):
        parent = row_of_body[int(robot.parent[joint])]
        model.row[joint], model.parent[row] = row, parent
        model.continues[row] = parent == row
        if parent != row:
            model.branches[parent] = 1.0
        if joint >= robot.n:
            spring = robot.springs[joint - robot.n]
            model.stiffness[row], model.damping[row], model.rest[row] = spring
    return model
