"""The robot as arrays, from YAML, URDF or a program, checked for physical consistency."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.config.arguments import as_numbers, as_path
from space_robot_msgs_py.config.text import html_table
from space_robot_msgs_py.config.validation import one_of, read_yaml, short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ..dynamics.model import Model
from ..elementary.matrices import Array, product
from ..elementary.rotations import plain_sin_cos
from .files import exact_document, read_content
from .flatten import robot_arrays
from .inertia import inertia_elements, inertia_tensor
from .parts import (
    UNLIMITED,
    Base,
    Body,
    Gear,
    JointFriction,
    JointLimits,
    Part,
    Plate,
    RobotTree,
    Spring,
    Tool,
    Visual,
)
from .urdf import UrdfRobot, read_urdf

RANK_TOLERANCE = 1e-7
"""Singular values below this share of the largest count as zero."""


@dataclass(frozen=True, eq=False)
class Robot:
    """A satellite base with arms, panels and booms: a tree of bodies, each moved by one joint.

    Arrays over joints have the n actuated ones first, then the passive ones with springs, N in all;
    each group branch by branch from the base. Body 0 is the base, body j + 1 is moved by joint j;
    the z axis of its frame is the joint's axis. The base's frame is at its CoM, but for `nominal`.
    """

    name: str
    joint_names: tuple[str, ...]
    """Names of the n actuated joints, in the order of all arrays of the flight software."""
    passive_names: tuple[str, ...]
    body_names: tuple[str, ...]
    mass: Array
    """(N+1,) masses, kg, base first."""
    inertia: Array
    """(N+1, 3, 3) inertia about each body's CoM, kg m2, in its frame."""
    com: Array
    """(N+1, 3) centre of mass, m, in the body's frame."""
    parent: NDArray[np.int64]
    """(N,) number of the parent body of each joint."""
    rotation: Array
    """(N, 3, 3) axes of each joint's frame at zero, as columns, in parent axes."""
    offset: Array
    """(N, 3) from the parent's frame to the joint's, m, in the joint's axes at zero."""
    is_prismatic: NDArray[np.bool_]
    """(N,) True for prismatic joints, False for revolute ones."""
    limits: tuple[JointLimits, ...]
    """Limits of the n actuated joints."""
    friction: tuple[JointFriction, ...]
    """Friction of all N joints; NaN where that of the settings is used."""
    springs: tuple[Spring, ...]
    """Springs of the passive joints."""
    tools: tuple[Tool, ...]
    """Frames of the end effectors; the first one is *the* tool."""
    visuals: tuple[Visual, ...] = ()
    order: tuple[int, ...] = ()
    """Order of all joints branch by branch: parents before children."""
    gears: tuple[Gear | None, ...] = ()
    """Gears of the n actuated joints, None for rigid ones; empty: all are rigid."""
    plates: tuple[Plate, ...] = ()
    repairs: tuple[str, ...] = ()
    """Repairs of defects in its file, a line each."""
    source: str = ""
    """Name of its file, for errors; empty: it was made by a program."""

    @property
    def n(self) -> int:
        """Number of actuated joints."""
        return len(self.joint_names)

    @property
    def joint_count(self) -> int:
        """Number N of all joints."""
        return len(self.joint_names) + len(self.passive_names)

    @property
    def branches(self) -> tuple[int, ...]:
        """Number of actuated joints in each branch with actuated joints, in order."""
        counts: dict[int, int] = {}
        for joint in range(self.n):
            body = joint + 1
            while self.parent[body - 1]:
                body = int(self.parent[body - 1])
            counts[body] = counts.get(body, 0) + 1
        return tuple(counts.values())

    @property
    def all_joint_names(self) -> tuple[str, ...]:
        """Names of all N joints."""
        return self.joint_names + self.passive_names

    @property
    def geared_names(self) -> tuple[str, ...]:
        """Names of the joints with gears."""
        pairs = zip(self.joint_names, self.gears, strict=False)
        return tuple(name for name, gear in pairs if gear)

    @property
    def tool(self) -> Tool:
        """The end effector."""
        return self.tools[0]

    @property
    def where(self) -> str:
        """Its file for errors, or its name."""
        return self.source or f"robot {self.name!r}"

    @property
    def axis_names(self) -> tuple[str, ...]:
        """Names of the n+3 controlled coordinates: base x, y, z, then the actuated joints."""
        return BASE_AXES + self.joint_names

    @classmethod
    def from_tree(cls, tree: RobotTree, where: str = "robot") -> Robot:
        """Build the arrays from the parts of a robot, see `space_robot_model.robot.flatten`.

        Raises:
            InputError: not a tree, or one that cannot be flown; ``where`` names the file.
        """
        return cls(**robot_arrays(tree, where))

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
        if not isinstance(content, dict):
            raise InputError(f"{where}: a mapping was expected, got {short(content)}")
        read = read_content(content, folder or Path(), where)
        if isinstance(read, RobotTree):
            return replace(cls.from_tree(read, where), source=where)
        return cls._from_urdf(read, where)

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
        file = as_path(path, "path")
        return cls._from_urdf(read_urdf(file, base, repair), str(file))

    @classmethod
    def _from_urdf(cls, urdf: UrdfRobot, where: str) -> Robot:
        repairs = tuple(map(str, urdf.findings))
        return replace(cls.from_tree(urdf.tree, where), repairs=repairs, source=where)

    def _repr_html_(self) -> str:
        """Show bodies, joints and limits in a notebook."""
        return _html(self)

    @property
    def tree(self) -> RobotTree:
        """The parts from which `from_tree` builds this robot, branch by branch."""
        base = Base(float(self.mass[0]), self.inertia[0], self.com[0], self.body_names[0])
        return RobotTree(
            self.name,
            base,
            [self._link(joint) for joint in self.order],
            tools=self._on_links(self.tools),
            plates=self._on_links(self.plates),
            visuals=self._on_links(self.visuals),
            exact=True,
        )

    def _link(self, joint: int) -> Body:
        passive, friction = joint - self.n, self.friction[joint]
        return Body(
            name=self.body_names[joint + 1],
            parent=self.body_names[self.parent[joint]],
            joint="prismatic" if self.is_prismatic[joint] else "revolute",
            joint_name=self.all_joint_names[joint],
            rotation=self.rotation[joint],
            offset=self.offset[joint],
            mass=float(self.mass[joint + 1]),
            inertia=self.inertia[joint + 1],
            com=self.com[joint + 1],
            limits=self.limits[joint] if passive < 0 else UNLIMITED,
            friction=None if np.isnan(friction.coulomb) else friction,
            passive=self.springs[passive] if passive >= 0 else None,
            drive=self.gears[joint] if passive < 0 and self.gears else None,
        )

    def _on_links(self, parts: Sequence[Part]) -> list[Part]:
        return [replace(part, link=self.body_names[part.body]) for part in parts]

    @property
    def content(self) -> dict[str, Any]:
        """All numbers and shapes, as lists and texts; `from_dict` builds the same robot."""
        return exact_document(self.tree)

    @cached_property
    def nominal(self) -> Robot:
        """The robot assumed by the flight software: passive joints locked at rest.

        Its base has the frame of this robot's base, which measurements and goals refer to, and so
        its centre of mass elsewhere if a locked panel is part of it.
        """
        if not self.springs:
            return self
        tree = self.tree  # with the order of the actuated joints
        links = [_locked(link, link.passive.rest) if link.passive else link for link in tree.links]
        return Robot.from_tree(replace(tree, links=links))

    def with_springs(self, springs: Mapping[str, Spring]) -> Robot:
        """Return the robot with springs instead of motors in those of its joints that are named."""
        if not springs:
            return self
        tree = self.tree
        links = [
            replace(link, passive=springs[link.joint_label], drive=None)
            if link.joint_label in springs
            else link
            for link in tree.links
        ]
        return replace(Robot.from_tree(replace(tree, links=links), self.where), source=self.source)

    def from_degrees(self, values: ArrayLike) -> Array:
        """Convert positions of the n actuated joints to rad; m of prismatic joints are kept.

        Args:
            values: (..., n) in degrees, or m for prismatic joints.
        """
        numbers, n = self._joint_numbers(values), self.n
        return np.where(self.is_prismatic[:n], numbers, np.radians(numbers))

    def to_degrees(self, values: ArrayLike) -> Array:
        """Convert positions (..., n) in rad to degrees; m of prismatic joints are kept."""
        numbers, n = self._joint_numbers(values), self.n
        return np.where(self.is_prismatic[:n], numbers, np.degrees(numbers))

    def _joint_numbers(self, values: ArrayLike) -> Array:
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

        Rows are the tool's velocity (m/s) and angular velocity (rad/s) on inertial axes.

        Args:
            joint_positions: (N,) of all joints, rad, or m of prismatic ones.
            quaternion_wxyz: (4,) base attitude, unit.
            attitude: "held": the base does not turn; "free": angular momentum is zero, too, which
                gives the generalised Jacobian (Umetani & Yoshida 1989).
            tool: name of one of `tools`; None: the first.

        Raises:
            InputError: an argument has another type or shape, or there is no such tool.
        """
        from .kinematics import tool_state  # numba: slow to import

        one_of(attitude, ("held", "free"), "attitude")
        state = tool_state(self, quaternion_wxyz, joint_positions, tool)
        return state.held if attitude == "held" else state.free

    def reaction_null_space(
        self, joint_positions: ArrayLike, quaternion_wxyz: ArrayLike = (1.0, 0.0, 0.0, 0.0)
    ) -> Array:
        """Return an orthonormal basis of the joint velocities that leave the base's attitude alone.

        They have no angular momentum about the robot's centre of mass (Nenchev, Yoshida & Uchiyama
        1992): a column (N,) each, N - 3 of them in general.

        Args: see `tool_jacobian`.
        """
        from .kinematics import tool_state

        coupling = tool_state(self, quaternion_wxyz, joint_positions).coupling
        _, values, axes = np.linalg.svd(coupling)
        # rows of V^T beyond the rank span the null space
        rank = np.count_nonzero(values > RANK_TOLERANCE * values.max(initial=0.0))
        basis: Array = axes[rank:].T
        return basis

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
        """The constants of the compiled algorithms, with joints in the order of visits."""
        model, count, order = Model.allocate(self.n), self.joint_count, list(self.order)
        bodies = [0, *(joint + 1 for joint in order)]
        row_of_body = {body: row for row, body in enumerate(bodies)}
        assign(model, joint_count=count, actuated_count=self.n)
        model.mass[: count + 1] = self.mass[bodies]
        model.inertia[: count + 1] = inertia_elements(self.inertia[bodies])
        model.com[: count + 1] = self.com[bodies]
        model.rotation[:count] = self.rotation[order].reshape(count, 9)
        model.offset[:count] = self.offset[order]
        model.is_prismatic[:count] = self.is_prismatic[order]
        for row, joint in enumerate(order):
            parent = row_of_body[int(self.parent[joint])]
            model.row[joint], model.parent[row] = row, parent
            # the parent was visited just before: its values are still in registers
            model.continues[row] = parent == row
            if parent != row:
                model.branches[parent] = 1.0
            if joint >= self.n:
                spring = self.springs[joint - self.n]
                model.stiffness[row], model.damping[row], model.rest[row] = spring
        return model


def _locked(link: Body, position: float) -> Body:
    """Return a link on a fixed joint with the pose of its joint at ``position``, rad or m."""
    offset, rotation = link.offset, link.rotation
    if link.joint == "prismatic":
        offset = offset + np.array([0.0, 0.0, position])
    else:
        s, c = plain_sin_cos(position)
        turn = np.array([[c, -s, 0.0], [s, c, 0.0], [0.0, 0.0, 1.0]])
        # the offset is in the link's own axes, which have turned
        offset, rotation = product(turn.T, offset), product(rotation, turn)
    return replace(
        link,
        joint="fixed",
        rotation=rotation,
        offset=offset,
        limits=UNLIMITED,
        friction=None,
        passive=None,
    )


HTML_HEADS = ("body", "mass, kg", "moved by", "on", "range", "velocity", "effort")


def _html(robot: Robot) -> str:
    passive, masses = len(robot.passive_names), [f"{mass:.6g}" for mass in robot.mass]
    words = [
        f"{robot.name}: {float(robot.mass.sum()):g} kg",
        f"{robot.n} joints with a motor",
        *([f"{passive} with a spring"] if passive else []),
        f"tools: {', '.join(tool.name for tool in robot.tools)}",
    ]
    rows = [[robot.body_names[0], masses[0], *[""] * 5]]
    for joint, name in enumerate(robot.all_joint_names):
        carrier = robot.body_names[robot.parent[joint]]
        moved = [robot.body_names[joint + 1], masses[joint + 1], name, carrier]
        rows.append([*moved, *_html_limits(robot, joint)])
    return html_table(HTML_HEADS, rows, ", ".join(words))


def _html_limits(robot: Robot, number: int) -> list[str]:
    """Return range, velocity and effort of a joint; empty where there is no limit."""
    if number >= robot.n:
        return ["", "", "passive, with a spring"]
    factor, unit, force = (
        (1.0, "m", "N") if robot.is_prismatic[number] else (180.0 / math.pi, "deg", "N m")
    )
    limits = robot.limits[number]
    ends = [factor * limits.lower, factor * limits.upper]
    return [
        f"{ends[0]:.5g} to {ends[1]:.5g} {unit}" if any(map(math.isfinite, ends)) else "",
        f"{factor * limits.velocity:.5g} {unit}/s" if math.isfinite(limits.velocity) else "",
        f"{limits.effort:.5g} {force}" if math.isfinite(limits.effort) else "",
    ]
