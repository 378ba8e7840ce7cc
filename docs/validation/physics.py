"""Dynamics, friction, gears, captures and orbits beside Pinocchio, MuJoCo, SciPy and Basilisk."""

from __future__ import annotations

import json
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import mujoco
import numpy as np
import oracles
import pinocchio as pin
import strategies
from kernels import plant_steps
from numpy.typing import NDArray
from oracles import momenta, orbit, rotation_of, rotors
from oracles.friction import StickSlip
from robots import (
    ANGLES_DEG,
    MOTORS,
    NO_FRICTION,
    coast,
    held_place,
    orbiting_plant,
    plant_numbers,
    rigid_robot,
    set_motion,
    tensor_of,
)
from rows import MUJOCO, PINOCCHIO, SCIPY, ValidationRow, relative
from simulators import MuJoCo, Ours, mujoco_model
from start import Start

import space_robot as sr
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings

Array = NDArray[np.float64]
ROBOTS, FLIGHTS, HOLDS, CAPTURES, POSTURES = 300, 6, 16, 50, 100
PERIOD_S, DAY_S, COULOMB = 5e-4, 86_400.0, 7.0
"""s, s, and N m."""
DURATION_S, STEP_S, SAMPLES = 600.0, 2e-3, 100
"""Of the robot that tumbles."""
INTEGRATORS = "Euler", "implicit", "implicitfast", "RK4"
BASILISK: dict[str, Any] = json.loads(Path(__file__).with_name("basilisk.json").read_text("utf-8"))
KINDS = "revolute", "prismatic", "fixed", "revolute", "revolute"
EQUATIONS = "mass matrix, Coriolis forces, forward dynamics"


def trees() -> Iterator[ValidationRow]:
    """Compare trees of turning, sliding, passive and fixed joints; and branched robots."""
    largest, of_branched = np.zeros(5), np.zeros(4)
    for seed in range(ROBOTS):
        rng = np.random.default_rng(seed)
        tree = strategies.random_tree(
            rng, ["revolute", *rng.choice(strategies.KINDS, rng.integers(9)).tolist()]
        )
        robot = Robot.from_tree(tree)
        tool = robot.tools[-1].name
        oracle = oracles.ToolOracle(robot, tree, tool, seed)
        posture = oracle.positions, oracle.attitude()
        jacobians = [
            relative(robot.tool_jacobian(*posture, attitude, tool), oracle.jacobian_of(attitude))
            for attitude in ("held", "free")
        ]
        differences = [*oracles.dynamics_differences(robot, oracle, seed), *jacobians]
        largest = np.maximum(largest, differences)
        robot = strategies.random_branched_robot(rng, int(rng.choice(strategies.JOINTS)))
        state = strategies.random_state(rng, robot.n)
        wanted = rng.normal(size=(1, robot.n + 3))
        torque = inverse_dynamics(robot, oracles.references_of([state], wanted))[0]
        force = oracles.in_inertial(state, torque)
        moved = oracles.pinocchio_forward_dynamics(robot, state, force)
        differences = [np.abs(moved[3:] - wanted).max() / np.abs(moved).max()]
        of_branched = np.maximum(of_branched, differences + beside_mujoco(robot, state, force))
    jacobians, extent = "Jacobians of a tool, base held or free", f"{ROBOTS} random trees"
    yield ValidationRow(EQUATIONS, PINOCCHIO, extent, float(largest[:3].max()), 1e-11)
    yield ValidationRow(jacobians, PINOCCHIO, extent, float(largest[3:].max()), 1e-11)
    extent = f"{ROBOTS} random robots"
    yield ValidationRow("inverse dynamics", PINOCCHIO, extent, float(of_branched[0]), 1e-11)
    yield ValidationRow(EQUATIONS, MUJOCO, extent, float(of_branched[1:].max()), 1e-11)


def beside_mujoco(robot: Robot, state: strategies.State, force: Array) -> list[float]:
    """Return the differences of mass matrix, bias force and accelerations from MuJoCo's."""
    model, size, joints = mujoco_model(robot), 6 + robot.n, oracles.visited(robot, state)
    data, mass, to_base = mujoco.MjData(model), np.zeros((size, size)), np.eye(size)
    # MuJoCo's base turns on its own axes, and its joints are in another order
    to_base[3:6, 3:6] = rotation_of(state.quaternion).as_matrix().T
    to_base = to_base[[*range(6), *(6 + joint for joint in robot.order)]]
    data.qpos[:] = [0.0, 0.0, 0.0, *state.quaternion, *joints.theta]
    data.qvel[:], data.qfrc_applied[:] = to_base @ state.velocity, to_base @ force
    mujoco.mj_forward(model, data)
    mujoco.mj_fullM(model, data, mass)
    motion = state.quaternion, state.theta, state.w0, state.rate
    return [
        relative(sr.mass_matrix(robot, *motion[:2]), to_base.T @ mass @ to_base),
        relative(sr.bias_force(robot, *motion), to_base.T @ data.qfrc_bias),
        relative(sr.forward_dynamics(robot, *motion, force), to_base.T @ data.qacc),
    ]


def invariants(robot: Robot, x: Array) -> tuple[Array, Array, float]:
    """Return linear momentum, angular momentum about the centre of mass, and kinetic energy."""
    model, (theta, v0, w0, rate) = oracles.pinocchio_model(robot), np.split(x[7:], [6, 9, 12])
    state = strategies.State(x[3:7] / np.linalg.norm(x[3:7]), theta, v0, w0, rate)
    data, motion = model.createData(), oracles.pinocchio_state(state)
    momentum = pin.computeCentroidalMomentum(model, data, *motion)
    return momentum.linear, momentum.angular, pin.computeKineticEnergy(model, data, *motion)


def drifts(integrator: str) -> Array:
    """Return time and relative drifts of `invariants` (SAMPLES, 4); "": of our plant."""
    robot, steps = find_robot("paper"), round(DURATION_S / STEP_S / SAMPLES)
    start = Start.moving(robot, rate=0.3)
    ours, peer, rows = Ours(start, has_environment=False), MuJoCo(start), []
    peer.model.opt.timestep = STEP_S
    if integrator:
        peer.model.opt.integrator = getattr(mujoco.mjtIntegrator, f"mjINT_{integrator.upper()}")
    first, buffer = invariants(robot, start.x), ours.plant.command_delay_buffer
    for begin in range(0, SAMPLES * steps, steps):
        if integrator:
            peer.step(steps)
        else:
            plant_steps(ours.plant.block, buffer, np.zeros(9), begin, steps, STEP_S)
        pairs = zip(invariants(robot, (peer if integrator else ours).x), first, strict=True)
        changes = [np.linalg.norm(np.subtract(a, b)) / np.linalg.norm(b) for a, b in pairs]
        rows.append([(begin + steps) * STEP_S, *changes])
    return np.array(rows)


def plant_of(robot: Robot, period: float = PERIOD_S, **settings: Any) -> Plant:
    """Return a plant without friction unless it is set."""
    usual = {"initial_joints_deg": [0.0] * robot.n, "friction": NO_FRICTION}
    return Plant(robot, PlantSettings.model_validate({**usual, **settings}), period)


def fly(plant: Plant, torque: Array, ticks: int) -> None:
    """Hold a torque (n+3,) on base and joints over some ticks."""
    for _ in range(ticks):
        plant.step(Command(plant.tick, torque))


def joints() -> Iterator[ValidationRow]:
    """Compare motors behind springs, friction that sticks and slips, and the integrator's order."""
    largest, kept = 0.0, 0.0
    for seed in range(FLIGHTS):
        rng = np.random.default_rng(seed)
        robot = Robot.from_tree(strategies.random_tree(rng, KINDS))
        robot = strategies.random_gears(rng, replace(robot, friction=((0.0, 0.0),) * robot.n))
        gears = [gear and gear._replace(ratio=10.0) for gear in robot.gears]
        robot = strategies.with_gears(robot, gears)
        spinning = rotors.random_motor_rotors(rng, robot)
        plant, equations = plant_of(robot, substeps=4), rotors.RotorEquations(robot, spinning)
        torque = np.concatenate([np.zeros(3), rng.uniform(-9.0, 9.0, robot.n)])
        force = np.concatenate([np.zeros(3), torque, torque[3:][equations.joints]])
        force[6:][equations.joints] = 0.0
        start = plant_numbers(plant)
        fly(plant, torque, 400)
        solved = equations.fly(start, 0.0, 400 * PERIOD_S, lambda t, x, force=force: force)
        largest = max(largest, relative(plant_numbers(plant), solved.y[:, -1]))
        spins = plant.truth.motor_velocities[: len(spinning)]
        state = momenta.state_of(robot, plant.truth)
        momentum = rotors.pinocchio_momentum(robot, spinning, state, spins)
        kept = max(kept, float(np.abs(momentum).max()))
    dop, extent = SCIPY, f"{FLIGHTS} random trees, 0.2 s"
    yield ValidationRow("gears: motion", dop, extent, largest, 1e-8)
    name = "gears: momentum from rest (N s, N m s)"
    yield ValidationRow(name, PINOCCHIO, extent, kept, 1e-11)
    apart, events = np.zeros(2), 0
    for seed in range(FLIGHTS):
        rng = np.random.default_rng(seed)
        robot, rates = strategies.random_robot(rng, 3), rng.normal(size=3) * rng.integers(0, 2, 3)
        friction = {"coulomb": COULOMB, "viscous": 0.0}
        sign = {"friction": {**friction, "set_valued": False}, "substeps": 16}
        plants = plant_of(robot, friction=friction), plant_of(robot, **sign)
        motion = [*strategies.random_quaternion(rng), *rng.normal(size=3), *np.zeros(6), *rates]
        for plant in plants:
            plant.memory.x[3:19] = motion
        oracle = StickSlip(robot, plants[0].memory.x[:19], COULOMB)
        for torque in 10.0 * rng.normal(size=(HOLDS, 6)):
            oracle.fly(torque, 100 * PERIOD_S)
            for k, plant in enumerate(plants):
                fly(plant, torque, 100)
                apart[k] = max(apart[k], np.abs(plant.memory.x[16:19] - oracle.x[16:19]).max())
        events += oracle.events
    extent = f"{FLIGHTS} arms, {HOLDS * 100 * PERIOD_S:g} s, {events} events"
    for name, difference, limit in zip(
        ("exact", "sign in 16 substeps"), apart.tolist(), (1e-7, 1e-3), strict=True
    ):
        title = f"stick and slip, {name} (rad/s)"
        yield ValidationRow(title, SCIPY, extent, difference, limit)
    robot, errors = strategies.random_robot(np.random.default_rng(1), 3), []
    for step in (2e-3, 1e-3, 5e-4):
        plant = plant_of(robot, step)
        plant.memory.x[10:19] = [0.1, 0.0, -0.2, 0.2, -0.4, 0.3, 1.0, -2.0, 1.5]
        start = plant.memory.x[:19].copy()
        fly(plant, np.zeros(6), round(0.32 / step))
        solved = rotors.RotorEquations(robot).fly(start, 0.0, 0.32, lambda t, x: np.zeros(9))
        errors.append(relative(plant.memory.x[7:19], solved.y[7:, -1]))
    off = float(np.abs(-np.diff(np.log2(errors)) - 4.0).max())
    yield ValidationRow(
        "order of the integrator, less 4", dop, "steps of 2, 1 and 0.5 ms", off, 0.1
    )


def captures() -> Iterator[ValidationRow]:
    """Compare the momenta before and after a body is caught."""
    robot, largest, tick = find_robot("paper"), 0.0, 100
    for seed in range(CAPTURES):
        rng = np.random.default_rng(seed)
        v, w, at = rng.normal(size=(3, 3)).tolist()
        content: dict[str, Any] = {
            "mass": float(rng.uniform(1.0, 200.0)),
            "inertia": strategies.random_inertia(rng, 20.0),
            "place": {"position": at, "quaternion": strategies.random_quaternion(rng).tolist()},
            "motion": {"relative_to": "inertial", "velocity": v, "angular_velocity": w},
        }
        target = Target.from_dict({"target": content})
        event = f"capture@{tick * PERIOD_S}:{target.inline}"
        plants = [plant_of(robot, initial_joints_deg=ANGLES_DEG, events=e) for e in ([], [event])]
        torque = 20.0 * rng.normal(size=9)
        for plant in plants:
            fly(plant, torque, tick)
        place, inertia = held_place(robot, plants[0].truth, target), tensor_of(target)
        own = orbit.BodyMotion.of(target.mass, *place, inertia, np.array(v), np.array(w))
        expected = orbit.whole_momenta([*orbit.body_motions(robot, plants[0].truth), own])
        after = momenta.momentum(plants[1].robot, plants[1].truth)
        largest = max(largest, relative(after, expected))
    name, extent = "capture: momenta", f"{CAPTURES} random targets"
    yield ValidationRow(name, "both bodies before", extent, largest, 1e-11)


def in_orbit() -> Iterator[ValidationRow]:
    """Compare orbits, the torque of gravity, and what acts on plates and dipoles."""
    elements = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 20.0}
    robot, gravity = rigid_robot(80.0, [6.0, 5.0, 4.0]), {"gradient": False, "j2": True}
    plant = orbiting_plant(robot, 2.0, orbital_elements=elements, gravity=gravity)
    start = plant.truth.orbit_position.copy(), plant.truth.orbit_velocity.copy()
    (end,) = orbit.free_path(*start, DAY_S, True)
    off = float(np.linalg.norm(coast(plant, round(DAY_S / 2.0)).orbit_position - end[:3]))
    name, extent = "orbit with J2, position (m)", "a day in steps of 2 s"
    yield ValidationRow(name, SCIPY, extent, off, 1e-2)
    largest = 0.0
    for seed in range(POSTURES):
        rng = np.random.default_rng(seed)
        robot = strategies.random_robot(rng, MOTORS)
        plant = orbiting_plant(
            robot,
            0.5,
            orbital_elements={**elements, "height": float(rng.uniform(300e3, 36e6))},
            gravity={"gradient": True, "j2": True},
            initial_quaternion=strategies.random_quaternion(rng).tolist(),
            initial_joints_deg=rng.uniform(-180.0, 180.0, MOTORS).tolist(),
        )
        set_motion(plant, position=rng.normal(size=3))
        torque = orbit.weight_torque(robot, plant.truth, True)
        largest = max(largest, relative(plant.truth.external_torques[:3], torque))
    name, extent = "torque of gravity on an arm", f"{POSTURES} robots and orbits"
    yield ValidationRow(name, "50 digits", extent, largest, 1e-11)
    yield from beside_basilisk()


def beside_basilisk() -> Iterator[ValidationRow]:
    """Compare a satellite of one body with what basilisk_numbers.py has stored."""
    settings, peer = BASILISK["settings"], f"Basilisk {BASILISK['version']}"
    keys = "area", "drag_coefficient", "specular", "diffuse", "normal", "centre"
    plates = [{"link": "base", **dict(zip(keys, p, strict=True))} for p in settings["plates"]]
    robot = rigid_robot(settings["mass"], settings["principal"], plates=plates)

    def satellite(state: dict[str, Any], **options: Any) -> Plant:
        attitude = state["quaternion"]
        plant = orbiting_plant(robot, settings["step"], initial_quaternion=attitude, **options)
        plant.memory.x[25:31] = [*state["position"], *state["velocity"]]
        plant.memory.environment.orbit.sun[:] = state["sun"]
        set_motion(plant, omega=rotation_of(attitude).apply(state["omega"]))
        return plant

    start, ticks = BASILISK["states"][0], round(settings["duration"] / settings["step"])
    extent = f"{settings['duration']:g} s in steps of {settings['step']:g} s"
    flown = coast(satellite(start, gravity={"gradient": False, "j2": True}), ticks)
    off = relative(flown.orbit_position + flown.base_position, BASILISK["j2"]["position"])
    yield ValidationRow("orbit with J2, position", peer, extent, off, 1e-11)
    flown = coast(satellite(start, gravity={"gradient": True, "j2": False}), ticks)
    off = relative(rotation_of(flown.quaternion).as_matrix(), BASILISK["gradient"]["axes"])
    yield ValidationRow("attitude under the gravity gradient", peer, extent, off, 1e-8)
    g11, h11, g10 = settings["dipole"]
    strength = float(np.linalg.norm(settings["dipole"]))
    tilt, pole = np.degrees([np.arccos(-g10 / strength), np.arctan2(-h11, -g11)]).tolist()
    acts = {
        "atmosphere": settings["air"],
        "sunlight": {"pressure": settings["pressure"]},
        "magnetism": {"strength": strength, "tilt_deg": tilt, "pole_deg": pole},
    }
    surfaces, of_field = 0.0, 0.0
    for state, acting in zip(BASILISK["states"], BASILISK["acting"], strict=True):
        plant, turn = satellite(state, **acts), rotation_of(state["quaternion"])
        of_field = max(of_field, relative(turn.apply(plant.truth.magnetic_field), acting["field"]))
        for name in ("drag", "sunlight"):  # moment, force on inertial axes; theirs on the body's
            wrench = np.array(getattr(plant.memory.environment.surfaces, name)).reshape(2, 3)
            surfaces = max(surfaces, relative(turn.inv().apply(wrench[::-1]), acting[name]))
    extent = f"{len(BASILISK['states'])} states"
    yield ValidationRow("drag and sunlight on plates", peer, extent, surfaces, 1e-11)
    yield ValidationRow("magnetic field", peer, extent, of_field, 1e-11)
