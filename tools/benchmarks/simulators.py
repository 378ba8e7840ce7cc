"""The plant beside MuJoCo, Pinocchio and Basilisk: the same robot, the same start, RK4 of 0.5 ms.

A state is that of the plant: ``[r0, quaternion, theta, v0, w0, thetadot]``, velocities on
inertial axes. The peers have viscous friction only, which costs them least; our step has both
frictions and the disturbances of case 3.
"""

from __future__ import annotations

from collections.abc import Iterator
from importlib.util import find_spec
from statistics import median
from typing import Any

import mujoco
import numpy as np
import pinocchio as pin
from kernels import Array, plant_steps
from measuring import Competitor, Row, Run, timed
from mujoco import rollout
from oracles import pinocchio_model, quaternion_of
from plant import forward_dynamics_of, moving_plant
from scipy.spatial.transform import Rotation
from start import PERIOD, Start, rotation_of

from space_robot import forward_dynamics
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.friction import FrictionSettings
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

BATCH = 64
"""Calls of ``pin.aba`` that C++ makes in a row."""
FRICTION = FrictionSettings()
STEP, IN_CPP = "space_robot, step", "pinocchio, aba in C++"
APART = {"mujoco": 1e-8, "basilisk": 1e-9, "pinocchio": 1e-9}
"""Largest difference in any number of the state or acceleration; MuJoCo turns inertias to principal
axes by an iteration."""
MOTION = 1e-3
"""The least that the plant moves: at rest every robot is the same."""


def mujoco_model(robot: Robot) -> mujoco.MjModel:
    """Return the same robot in MuJoCo, without gravity: a free joint, hinges and slides of z."""

    def numbers(values: Any) -> str:
        return " ".join(repr(float(value)) for value in values)

    def branch(body: int) -> str:
        tensor = robot.inertia[body]
        full = [tensor[ij] for ij in ((0, 0), (1, 1), (2, 2), (0, 1), (0, 2), (1, 2))]
        text = (
            f'<inertial pos="{numbers(robot.com[body])}" mass="{float(robot.mass[body])!r}" '
            f'fullinertia="{numbers(full)}"/>'
        )
        for i in (joint for joint in robot.order if robot.parent[joint] == body):
            place = numbers(robot.rotation[i] @ robot.offset[i])
            turn = numbers(quaternion_of(Rotation.from_matrix(robot.rotation[i])))
            kind = "slide" if robot.is_prismatic[i] else "hinge"
            text += (
                f'<body pos="{place}" quat="{turn}"><joint type="{kind}" axis="0 0 1"/>'
                f"{branch(i + 1)}</body>"
            )
        return text

    base = f'<body name="base"><freejoint/>{branch(0)}</body>'
    return mujoco.MjModel.from_xml_string(
        f'<mujoco><option gravity="0 0 0"/><worldbody>{base}</worldbody></mujoco>'
    )


def chain(joints: int) -> Robot:
    """Return the paper's satellite with its links one after the other as often as needed."""
    content: Any = read_yaml(named_file("robots", "paper"))
    links = content["robot"]["links"]
    content["robot"]["links"] = [
        {**links[i % len(links)], "name": f"joint{i + 1}"} for i in range(joints)
    ]
    return Robot.from_dict(content)


class Ours:
    """The plant; with an environment: friction and disturbances of case 3."""

    name = "space_robot"

    def __init__(self, start: Start, has_environment: bool = True) -> None:
        scale = float(has_environment)
        settings = PlantSettings(
            initial_joints_deg=[0.0] * start.robot.n,
            friction=FRICTION if has_environment else FrictionSettings(coulomb=0.0, viscous=0.0),
            disturbance=DisturbanceSettings(scale=scale),
        )
        self.plant = Plant(start.robot, settings, PERIOD)
        self._x = self.plant.block[0].x[: start.x.size]
        self._x[:] = start.x
        self._torque, self._ticks = start.torque.copy(), 0

    def step(self, steps: int) -> None:
        """Integrate."""
        block, buffer = self.plant.block, self.plant.command_delay_buffer
        plant_steps(block, buffer, self._torque, self._ticks, steps, PERIOD)
        self._ticks += steps

    @property
    def x(self) -> Array:
        """The state reached."""
        return np.array(self._x)


class MuJoCo:
    """``mj_step`` with RK4, its loop over steps in C; contacts and all sensors off.

    Viscous friction is joint damping. Coulomb friction is MuJoCo's ``frictionloss``, a constraint
    for its solver; without it no constraint is left.
    """

    name = "mujoco"

    def __init__(self, start: Start, viscous: float = 0.0, coulomb: float = 0.0) -> None:
        self.model = model = mujoco_model(start.robot)
        model.opt.timestep = PERIOD
        model.opt.integrator = mujoco.mjtIntegrator.mjINT_RK4
        off = ["CONTACT", "LIMIT", "EQUALITY", "SENSOR", "ACTUATION", "GRAVITY", "SPRING"]
        for name in off if coulomb else [*off, "CONSTRAINT"]:
            model.opt.disableflags |= getattr(mujoco.mjtDisableBit, f"mjDSBL_{name}")
        model.dof_damping[6:] = viscous
        model.dof_frictionloss[6:] = coulomb
        self.data = data = mujoco.MjData(model)
        data.qpos[3:7], data.qpos[7:] = start.quaternion, start.theta
        data.qvel[:3], data.qvel[6:] = start.v0, start.rate
        data.qvel[3:6] = start.rotation.inv().apply(start.w0)
        data.qfrc_applied[3:] = start.torque

    def step(self, steps: int) -> None:
        """Integrate."""
        mujoco.mj_step(self.model, self.data, steps)

    def rollout(self, width: int) -> Competitor:
        """Return the steps of ``width`` equal states together."""
        kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
        state = np.zeros(mujoco.mj_stateSize(self.model, kind))
        mujoco.mj_getState(self.model, self.data, state, kind)
        states, data = np.tile(state, (width, 1)), mujoco.MjData(self.model)
        return lambda n: rollout.rollout(self.model, data, states, nstep=max(1, n // width))

    @property
    def x(self) -> Array:
        """The state reached."""
        q, v = self.data.qpos, self.data.qvel
        return np.concatenate([q, v[:3], rotation_of(q[3:7]).apply(v[3:6]), v[6:]])


class Pinocchio:
    """Articulated bodies by Pinocchio in one state; the base's twist is in the base frame."""

    def __init__(self, start: Start) -> None:
        self.model = pinocchio_model(start.robot)
        self._turn = start.rotation
        q, back = start.quaternion, start.rotation.inv()
        position = np.concatenate([np.zeros(3), q[1:], q[:1], start.theta])
        velocity = np.concatenate([back.apply(start.v0), back.apply(start.w0), start.rate])
        self._now = (position, velocity, np.concatenate([np.zeros(3), start.torque]))
        self._pool = pin.ModelPool(self.model, 1)
        self._columns = [np.asfortranarray(np.tile(c[:, None], BATCH)) for c in self._now]
        self._batch = np.zeros((self.model.nv, BATCH), order="F")

    def batches_in_cpp(self, batches: int) -> None:
        """Call ``pin.aba`` `BATCH` times in a row on one thread, for each of ``batches``."""
        for _ in range(batches):
            pin.abaInParallel(1, self._pool, *self._columns, self._batch)

    @property
    def acceleration(self) -> Array:
        """``[v0dot, w0dot, thetadd]`` on inertial axes, by the loop in C++."""
        self.batches_in_cpp(1)
        velocity, spatial = self._now[1], self._batch[:, -1].copy()
        spatial[:3] += np.cross(velocity[3:6], velocity[:3])
        turned = [self._turn.apply(spatial[:3]), self._turn.apply(spatial[3:6])]
        return np.concatenate([*turned, spatial[6:]])


def beside(start: Start) -> dict[str, Competitor]:
    """Return what is timed, in one state, without torques."""
    competitors: dict[str, Competitor] = {
        STEP: Ours(start).step,
        "mujoco, step": MuJoCo(start, FRICTION.viscous).step,
        "space_robot, forward dynamics": forward_dynamics_of(Ours(start).plant),
        IN_CPP: Pinocchio(start).batches_in_cpp,
    }
    if find_spec("Basilisk"):
        from basilisk import Basilisk

        competitors["basilisk, step"] = Basilisk(start, FRICTION.viscous).step
    return competitors


def same_motion(start: Start, steps: int) -> Iterator[Row]:
    """Integrate everybody; how far the plant moves, and how far the peers then are from it."""
    ours, flown = Ours(start, has_environment=False), f"{start.robot.n} joints, {steps} steps"
    ours.step(steps)
    yield Row(f"{flown}: motion", "", (apart(start.x, ours.x),), is_rate=True, limit=MOTION)
    peers: list[Any] = [MuJoCo(start)]
    if find_spec("Basilisk"):
        from basilisk import Basilisk

        peers.append(Basilisk(start))
    for peer in peers:
        peer.step(steps)
        difference = apart(ours.x, peer.x)
        yield Row(f"{flown}: {peer.name} apart", "", (difference,), limit=APART[peer.name])
    force = np.concatenate([np.zeros(3), start.rotation.apply(start.torque[:3]), start.torque[3:]])
    state = start.quaternion, start.theta, start.w0, start.rate
    own = forward_dynamics(start.robot, *state, force)
    difference = float(np.abs(own - Pinocchio(start).acceleration).max())
    title = f"{start.robot.n} joints, acceleration: pinocchio apart"
    yield Row(title, "", (difference,), limit=APART["pinocchio"])


def apart(one: Array, other: Array) -> float:
    """Return the largest difference of two states; the sign of a quaternion means nothing."""
    other = other.copy()
    other[3:7] *= np.sign(one[3:7] @ other[3:7])
    return float(np.abs(one - other).max())


def peers(run: Run) -> Iterator[Row]:
    """Time a step of the paper's robot with its payload beside each peer."""
    run.progress("one plant step beside its peers")
    robot = moving_plant().robot
    start, loss = Start.moving(robot), "mujoco with friction loss"
    competitors = beside(start)
    competitors[loss] = MuJoCo(start, FRICTION.viscous, FRICTION.coulomb).step
    seconds = run.interleave(competitors)
    four = tuple(4.0 / BATCH * s for s in seconds[IN_CPP])
    for name in (name for name in seconds if name.startswith(("mujoco", "basilisk"))):
        yield timed(STEP, "us", seconds[STEP], (name, seconds[name]))
    yield timed(STEP, "us", seconds[STEP], (f"four {IN_CPP}", four))
    yield from same_motion(Start.moving(robot, rate=0.3, torque=2.0), 400)


def growth(run: Run) -> Iterator[Row]:
    """Time arms of ten and of thirty joints: k of ``time ~ n^k``, one for each repetition."""
    run.progress("arms of ten and of thirty joints")
    starts = {n: Start.moving(chain(n)) for n in (10, 30)}
    parts = {f"{name}, {n}": part for n in starts for name, part in beside(starts[n]).items()}
    seconds = run.interleave(parts)
    for name in beside(starts[10]):
        few, many = (seconds[f"{name}, {n}"] for n in starts)
        exponents = tuple(np.log(np.divide(many, few)) / np.log(3.0))
        us = [1e6 * median(s) / (BATCH if name == IN_CPP else 1) for s in (few, many)]
        note = f"{us[0]:.3g} us with 10 joints, {us[1]:.3g} with 30"
        yield Row(f"exponent: {name}", "", tuple(map(float, exponents)), note=note)
    for n in starts:
        yield from same_motion(Start.moving(chain(n), rate=0.5, torque=1.0), 200)
