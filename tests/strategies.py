"""Physical robots, trees of bodies, URDF texts, states and logs, at random from a seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.inertia import inertia_tensor
from space_robot_model.robot.parts import Base, Body, Gear, JointFriction, RobotTree, Spring, Tool
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import LawInForce, Timebase

JOINTS = (1, 3, 6, 7)
"""Numbers of joints of random robots."""
KINDS = ("revolute", "prismatic", "fixed", "passive revolute", "passive prismatic")
"""Joints of random trees."""
BASE = "hull"
"""Base of a random tree."""
SEEDS = st.integers(0, 2**32 - 2)
RNGS = SEEDS.map(np.random.default_rng)
TREES = st.lists(st.sampled_from(KINDS), max_size=9).map(lambda kinds: ["revolute", *kinds])
"""Kinds of joints, of which one has a motor at least."""


class State(NamedTuple):
    """Position and velocity of a robot, base velocities on inertial axes."""

    quaternion: Array
    theta: Array
    v0: Array
    w0: Array
    rate: Array

    @property
    def velocity(self) -> Array:
        """``[v0, w0, thetadot]``."""
        return np.concatenate([self.v0, self.w0, self.rate])


class Case(NamedTuple):
    """A robot, its state, and the generator that made them, for whatever else is needed."""

    robot: Robot
    state: State
    rng: np.random.Generator


def random_quaternion(rng: np.random.Generator) -> Array:
    """Uniform on the sphere, so large turns are the rule."""
    quaternion = rng.normal(size=4)
    return quaternion / np.linalg.norm(quaternion)


def random_rotation(rng: np.random.Generator) -> Array:
    """Any turn; sometimes none, or by right angles."""
    turn = Rotation.from_quat(rng.normal(size=4))
    if rng.random() < 0.3:
        turn = Rotation.from_euler("xyz", 90 * rng.integers(-2, 3, 3), degrees=True)
    return np.eye(3) if rng.random() < 0.2 else turn.as_matrix()


def random_axis(rng: np.random.Generator) -> Array:
    """Any direction, or along x, y or z, there or back."""
    if rng.random() < 0.5:
        return np.eye(3)[rng.integers(3)] * rng.choice([-1.0, 1.0])
    axis = rng.normal(size=3)
    return axis / np.linalg.norm(axis)


def random_inertia(rng: np.random.Generator, scale: float) -> list[float]:
    """``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` of a solid body: second moments on turned axes."""
    second = rng.uniform(0.1, 1.0, 3) * scale
    axes = Rotation.from_quat(rng.normal(size=4)).as_matrix()
    tensor = axes @ np.diag(second.sum() - second) @ axes.T
    return [float(tensor[ij]) for ij in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]


def random_robot_file(rng: np.random.Generator, n: int) -> dict[str, Any]:
    """Content of the YAML file of a robot: any twist, products of inertia, CoMs off the axes."""
    base = {
        "mass": float(rng.uniform(50.0, 1000.0)),
        "inertia": random_inertia(rng, rng.uniform(20.0, 200.0)),
    }
    links = [
        {
            "name": f"joint{i + 1}",
            "alpha_deg": float(rng.uniform(-180.0, 180.0)),
            "a": float(rng.uniform(-1.0, 3.0)),
            "d": float(rng.uniform(-1.0, 2.0)),
            "mass": float(rng.uniform(2.0, 40.0)),
            "inertia": random_inertia(rng, rng.uniform(0.3, 3.0)),
            "com": rng.uniform(-1.0, 1.0, 3).tolist(),
        }
        for i in range(n)
    ]
    return {"robot": {"name": f"random{n}", "base": base, "links": links}}


def random_robot(rng: np.random.Generator, n: int) -> Robot:
    """A chain of ``n`` joints with motors."""
    return Robot.from_dict(random_robot_file(rng, n))


def random_branched_robot(rng: np.random.Generator, n: int) -> Robot:
    """A tree whose joints turn and slide and are in the order of visiting."""
    path, parents = [0], []
    for joint in range(n):  # each on the body before it, or on one that this one is on
        path = path[: rng.integers(1, len(path) + 1)]
        parents.append(path[-1])
        path.append(joint + 1)
    return replace(random_robot(rng, n), parent=np.array(parents), is_prismatic=rng.random(n) < 0.3)


def random_state(rng: np.random.Generator, n: int) -> State:
    """Any attitude and posture, velocities of some rad/s."""
    return State(
        quaternion=random_quaternion(rng),
        theta=rng.uniform(-np.pi, np.pi, n),
        v0=rng.normal(size=3),
        w0=rng.normal(size=3),
        rate=2.0 * rng.normal(size=n),
    )


@st.composite
def cases(draw: st.DrawFn, joints: Sequence[int] = JOINTS) -> Case:
    """Hypothesis strategy: chains with one of these numbers of joints in random states."""
    n, rng = draw(st.sampled_from(joints)), draw(RNGS)
    return Case(random_robot(rng, n), random_state(rng, n), rng)


@st.composite
def branched_cases(draw: st.DrawFn, joints: Sequence[int] = JOINTS) -> Case:
    """As `cases`, of `random_branched_robot`."""
    n, rng = draw(st.sampled_from(joints)), draw(RNGS)
    return Case(random_branched_robot(rng, n), random_state(rng, n), rng)


def random_joint(rng: np.random.Generator, name: str, kind: str) -> dict[str, Any]:
    """Fields of a link with a joint of one of `KINDS`, whose friction may be the settings'."""
    spring, friction = None, None
    if kind.startswith("passive"):
        spring = Spring(*rng.uniform((50.0, 0.0, -0.2), (300.0, 3.0, 0.2)).tolist())
    elif kind != "fixed" and rng.random() < 0.5:
        friction = JointFriction(0.0, float(rng.uniform(0.0, 0.5)))
    return {
        "joint_name": name,
        "joint": kind.removeprefix("passive "),
        "rotation": random_rotation(rng),
        "offset": rng.uniform(-1.0, 1.0, 3),
        "axis": random_axis(rng),
        "friction": friction,
        "passive": spring,
    }


def random_tree(rng: np.random.Generator, kinds: Sequence[str]) -> RobotTree:
    """A base and a link for each of ``kinds``, each on any one before it, in any order.

    A link on a fixed joint may have no mass. The joint of link "b3" is "j3".
    """
    base, tool = _part(rng, BASE, 20.0)
    parts: list[Any] = [Base(**base)]
    tools = {BASE: tool}
    for number, kind in enumerate(kinds):
        parent = parts[rng.integers(len(parts))].name
        massless = kind == "fixed" and rng.random() < 0.4
        joint = random_joint(rng, f"j{number}", kind)
        part, tools[f"b{number}"] = _part(rng, f"b{number}", 0.0 if massless else 1.0)
        parts.append(Body(**part, **joint, parent=parent))
    rng.shuffle(parts)
    links = [part for part in parts if part.name != BASE]
    own = [part for part in parts if part.name == BASE]
    return RobotTree("tree", own[0], links, tools=[tools[part.name] for part in parts])


def _part(rng: np.random.Generator, name: str, size: float) -> tuple[dict[str, Any], Tool]:
    inertia = inertia_tensor(random_inertia(rng, size * rng.uniform(0.3, 3.0)))
    tool = Tool(f"tool of {name}", random_rotation(rng), rng.uniform(-1.0, 1.0, 3), link=name)
    mass, com = size * float(rng.uniform(2.0, 40.0)), size * rng.uniform(-0.5, 0.5, 3)
    return {"name": name, "mass": mass, "inertia": inertia, "com": com}, tool


def with_gears(robot: Robot, gears: Sequence[Gear | None]) -> Robot:
    """The robot with a gear, or None, for each of its joints with motors."""
    return replace(robot, gears=tuple(gears) if any(gears) else ())


def rotor_room(robot: Robot, joint: int) -> float:
    """The rotor inertia, kg m2, that leaves the joint's parent positive definite.

    It is the parent's smallest principal moment, shared by the joints on that parent.
    """
    parent = robot.parent[joint]
    count = int((robot.parent[: robot.n] == parent).sum())
    return float(np.linalg.eigvalsh(robot.inertia[parent])[0]) / count


def random_gears(rng: np.random.Generator, robot: Robot) -> Robot:
    """The robot with gears of any ratio on about two thirds of its joints with motors."""
    gears: list[Gear | None] = []
    for joint in range(robot.n):
        gear = Gear(
            float(rng.uniform(0.05, 0.3)) * rotor_room(robot, joint),
            float(10.0 ** rng.uniform(-1.0, 2.0)),
            float(rng.uniform(50.0, 500.0)),
            float(rng.uniform(0.0, 1.0)),
        )
        gears.append(gear if rng.random() < 0.67 else None)
    if not any(gears):
        gears[0] = gear
    return with_gears(robot, gears)


MOVING = ("revolute", "continuous", "prismatic")
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


def words(values: Array | list[float]) -> str:
    """Numbers with all their digits."""
    return " ".join(repr(float(value)) for value in values)


def random_origin(rng: np.random.Generator) -> str:
    """Any place and turn of a URDF; sometimes none, sometimes a right angle."""
    if rng.random() < 0.2:
        return ""
    rpy = rng.uniform(-np.pi, np.pi, 3)
    if rng.random() < 0.3:
        rpy = 0.5 * np.pi * rng.integers(-2, 3, 3)
    return f'<origin xyz="{words(rng.uniform(-1.0, 1.0, 3))}" rpy="{words(rpy)}"/>'


def random_inertial(rng: np.random.Generator, size: float = 1.0) -> str:
    """The ``<inertial>`` of a solid body, its axes turned."""
    values = random_inertia(rng, size * rng.uniform(0.3, 3.0))
    moments = " ".join(f'{name}="{value!r}"' for name, value in zip(MOMENTS, values, strict=True))
    mass = float(size * rng.uniform(2.0, 40.0))
    return f'<inertial>{random_origin(rng)}<mass value="{mass!r}"/><inertia {moments}/></inertial>'


def random_urdf(rng: np.random.Generator, count: int) -> str:
    """A tree of ``count`` links beside the base, in any order; the first joint moves.

    A link behind a fixed joint may have no mass.
    """
    parts = [f'<link name="link0">{random_inertial(rng, 20.0)}</link>']
    for number in range(1, count + 1):
        kind = str(rng.choice((*MOVING, "fixed") if number > 1 else MOVING))
        massless = kind == "fixed" and rng.random() < 0.5
        inertial = "" if massless else random_inertial(rng)
        parts.append(f'<link name="link{number}">{inertial}</link>')
        limit = '<limit lower="-2" upper="3" velocity="1" effort="9"/>'
        parts.append(
            f'<joint name="joint{number}" type="{kind}">{random_origin(rng)}'
            f'<parent link="link{rng.integers(number)}"/><child link="link{number}"/>'
            f'<axis xyz="{words(random_axis(rng))}"/>'
            f"{limit if kind in ('revolute', 'prismatic') else ''}</joint>"
        )
    rng.shuffle(parts)
    return '<robot name="random">\n' + "\n".join(parts) + "\n</robot>\n"


TIMEBASE = Timebase(500_000)
LIMITS = {"base_torque_limit": 2.0, "joint_torque_limit": 1.5}


def random_log(
    n: int, ticks: int, seed: int, latency_ticks: int = 0, wall_clock: bool = False
) -> FlightLog:
    """States and torques at random, every number another, at a rest every now and then.

    Commands are applied as told, clipped to `LIMITS`, but for some; the quaternion jumps between Q
    and -Q, the desired one too.
    """
    rng = np.random.default_rng(seed)
    log = FlightLog.allocate(ticks, tuple(f"j{i}" for i in range(n)), TIMEBASE)
    for name in ("base_position", "base_velocity", "omega_base", "joint_velocities"):
        column = getattr(log, name)
        column[:] = rng.normal(size=column.shape)
    quaternion = np.array([1.0, 0.0, 0.0, 0.0]) + 0.1 * rng.normal(size=(ticks, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    log.quaternion[:] = quaternion * rng.choice([-1.0, 1.0], size=(ticks, 1))
    log.reference_base[:] = 0.0
    desired = quaternion + 1e-5 * rng.normal(size=(ticks, 4))
    desired /= np.linalg.norm(desired, axis=1, keepdims=True)
    log.reference_base[:, :4] = desired * rng.choice([-1.0, 1.0], size=(ticks, 1))
    log.reference_joints[:] = rng.normal(size=(ticks, 3, n))
    for rest in rng.choice(ticks, size=ticks // 12 + 1, replace=False):
        log.reference_joints[rest : rest + int(rng.integers(1, 4)), 1] = 0.0
    log.joint_positions[:] = log.reference_joints[:, 0] + 1e-5 * rng.normal(size=(ticks, n))
    log.commanded_torque = rng.normal(size=(ticks, n + 3))
    limit = np.array([2.0] * 3 + [1.5] * n)
    log.applied_torque[:] = rng.normal(size=(ticks, n + 3))
    due = log.commanded_torque[: max(0, ticks - latency_ticks - 1)]
    log.applied_torque[ticks - len(due) :] = np.clip(due, -limit, limit)
    held = rng.random(ticks) < 0.1
    log.applied_torque[held] *= 0.5
    log.commanded_torque[rng.random(ticks) < 0.1] = np.nan
    if wall_clock:
        log.latency_s = np.where(rng.random(ticks) < 0.2, np.nan, rng.exponential(3e-4, ticks))
    h_bar = tuple(rng.uniform(0.5, 50.0, n + 3).tolist())
    log.laws = (LawInForce(0, "tde_stc", {"h_bar": h_bar}, is_first=True),)
    log.flight = {
        "controller": "tde_stc",
        "command_latency_ticks": latency_ticks,
        "scenario": {"parameters": {"plant": LIMITS}},
    }
    return log
