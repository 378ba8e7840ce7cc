"""Robots made in code, targets that they meet, and plants of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import yaml
from numpy.typing import ArrayLike
from oracles import rotation_of
from oracles.momenta import state_of
from oracles.orbit import body_places
from paths import CONFIG, DATA
from strategies import with_gears

from space_robot_model.dynamics.model import Model
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import geared_joints
from space_robot_model.robot.parts import Gear
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.component import Installation
from space_robot_sim.environment.friction import Friction, FrictionSettings
from space_robot_sim.environment.neighbouring_orbit import target_state
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.environment.target import Target
from space_robot_sim.plant.mounting import mount_gears
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantSettings
from space_robot_sim.plant.tick import update_true_state

PERIOD = 5e-4
LOCKED = FrictionSettings(coulomb=1e6, viscous=0.0)
"""No joint breaks away: the robot is rigid."""
NO_FRICTION = FrictionSettings(coulomb=0.0, viscous=0.0)
PASSIVE_ROBOT = str(DATA / "passive_robot")
"""Of its six joints with motors ``boom`` slides; of its three without ``slosh`` does."""

DRIVE = {"rotor_inertia": 1e-2, "gear_ratio": 100.0, "stiffness": 1e6, "damping": 1e3}
"""With a motor as heavy as the arm, 100 kg m2 through the gear, so that all laws stay stable."""
ENCODERS = {1: "motor", 2: "link", 4: "both"}
"""By number of the link."""
PLATES = [
    {"link": "base", "area": 2.0, "normal": [1.0, 0.3, 0.0], "centre": [0.5, 0.2, 0.1]},
    {"link": "base", "area": 1.5, "normal": [-1.0, 0.0, 0.0], "centre": [-0.5, 0.0, 0.0]},
    {"link": "joint6", "area": 0.3, "normal": [0.0, 0.0, 1.0], "specular": 0.6, "diffuse": 0.1},
]


def driven_paper() -> dict[str, Any]:
    """The paper's robot with three gears and three plates."""
    content: dict[str, Any] = yaml.safe_load((CONFIG / "robots" / "paper.yaml").read_text())
    for number, encoder in ENCODERS.items():
        content["robot"]["links"][number]["drive"] = {**DRIVE, "encoder": encoder}
    content["robot"]["plates"] = PLATES
    return content


HEAVY = 1e15
"""kg and kg m2 of a base that torques of 1 N m do not move: by 1e-15 rad/s2."""


def oscillator(
    gear: Gear, link_inertia: float, base_inertia: float = HEAVY, joint: str = "revolute"
) -> Robot:
    """Return a robot of one joint with a gear, whose axis z goes through both centres of mass.

    Args:
        gear: of the joint.
        link_inertia: about the axis, kg m2; of a prismatic joint the link's mass, kg.
        base_inertia: the same of the base.
        joint: "revolute" or "prismatic".
    """
    link: dict[str, Any] = {
        "name": "joint",
        "joint": joint,
        "mass": link_inertia,
        "inertia": [link_inertia] * 3 + [0.0] * 3,
        "com": [0.0] * 3,
    }
    base = {"mass": base_inertia, "inertia": [base_inertia] * 3 + [0.0] * 3}
    robot = Robot.from_dict({"robot": {"name": "oscillator", "base": base, "links": [link]}})
    return with_gears(robot, [gear])


REFLECTED = (40.0, 100.0, 100.0, 1.5, 1.5, 0.3)
"""N^2 J, kg m2, of `geared_paper_arm`: half of what its links have about their joints."""


def geared_paper_arm(paper_robot: Robot, **changes: Any) -> Robot:
    """Return the paper's robot with gears of 1:100, whose joints its laws can hold.

    Lighter motors would need shorter periods: the laws' gains are for the links' inertia.
    ``changes``: of each `Gear`.
    """
    gears = [Gear(reflected / 1e4, 100.0, 2e4, 50.0) for reflected in REFLECTED]
    return with_gears(paper_robot, [gear._replace(**changes) for gear in gears])


def mounted(robot: Robot) -> Model:
    """Return the model of a robot with its gears, as the plant has it; without wheels."""
    model = robot.model.copy()
    friction = Friction.build(FrictionSettings(), Installation(robot.n, robot=robot))
    mount_gears(robot, model, friction, np.zeros(13 + 4 * robot.joint_count))
    return model


class GearedFlight:
    """A plant of a robot with gears, without Coulomb friction unless it is set."""

    def __init__(
        self, robot: Robot, substeps: int = 1, coulomb: float = 0.0, **settings: Any
    ) -> None:
        friction = FrictionSettings(coulomb=coulomb, viscous=0.0)
        given = {"initial_joints_deg": [0.0] * robot.n, "friction": friction, **settings}
        self.robot = robot
        self.plant = Plant(robot, PlantSettings(**given, substeps=substeps), PERIOD)
        n, count, x = robot.joint_count, len(geared_joints(robot)), self.plant.memory.x
        self.positions = x[7 : 7 + n]
        self.motor_positions = x[13 + 2 * n + count : 13 + 2 * n + 2 * count]
        """Of the plant's own numbers, see `Stages`; joints in the order of the model."""

    def fly(self, torque: Sequence[float] | Array, ticks: int = 1) -> RobotState:
        """Hold a torque (n+3,) on base and joints over some ticks; return the true state."""
        for _ in range(ticks):
            self.plant.step(Command(self.plant.tick, np.asarray(torque, float)))
        return self.plant.truth

    def rest(self, ticks: int = 1) -> RobotState:
        """Fly some ticks without torques; return the true state."""
        return self.fly(np.zeros(self.robot.n + 3), ticks)


def coast(plant: Plant, ticks: int) -> RobotState:
    """Fly on without any command and return the true state, which is overwritten in flight."""
    nothing = np.zeros(len(plant.names.commanded))
    for _ in range(ticks):
        plant.step(Command(plant.tick, nothing))
    return plant.truth


MOTORS = 6
"""As many as the paper's robot has, whose compiled kernels serve."""
ANGLES_DEG = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
BALL_MASS, BALL_INERTIA = 1e-3, 1e-6


def rigid_robot(mass: float, principal: Sequence[float], **base: Any) -> Robot:
    """Return a base with balls of a gram at its centre of mass, which are its links.

    Args:
        mass: of the whole, kg.
        principal: (3,) principal moments of inertia of the whole on the base's axes, kg m2.
        base: further keys of ``robot`` in its file.
    """
    ball = [BALL_INERTIA] * 3 + [0.0] * 3
    links = [
        {"name": f"ball{k}", "mass": BALL_MASS, "inertia": ball, "com": [0.0] * 3, "parent": "base"}
        for k in range(MOTORS)
    ]
    inertia = [moment - MOTORS * BALL_INERTIA for moment in principal] + [0.0] * 3
    body = {"mass": mass - MOTORS * BALL_MASS, "inertia": inertia}
    return Robot.from_dict({"robot": {"name": "rigid", "base": body, "links": links, **base}})


def orbiting_plant(robot: Robot, period: float, **settings: Any) -> Plant:
    """Return a plant in a circular orbit at 400 km, or what the settings say; nobody turns it."""
    orbit = {"orbital_elements": {"height": 400e3}, "gravity": {"gradient": True, "j2": False}}
    joints = {"initial_joints_deg": [0.0] * robot.n, "friction": LOCKED}
    usual = {"base_actuation": "none", **joints, **orbit}
    return Plant(robot, PlantSettings.model_validate({**usual, **settings}), period)


def plant_numbers(plant: Plant) -> Array:
    """A state as `RotorEquations` has it."""
    truth, count = plant.truth, len(geared_joints(plant.robot))
    state = state_of(plant.robot, truth)
    of_motors = truth.motor_velocities[:count], truth.motor_positions[:count]
    of_robot = state.quaternion, state.theta, state.velocity
    return np.concatenate([truth.base_position, *of_robot, *of_motors])


def set_motion(
    plant: Plant,
    position: ArrayLike = (0.0, 0.0, 0.0),
    velocity: ArrayLike = (0.0, 0.0, 0.0),
    omega: ArrayLike = (0.0, 0.0, 0.0),
    joint_rates: ArrayLike = 0.0,
) -> None:
    """Give base and joints of a plant a motion; all on inertial axes, from the orbit's point."""
    n, x = plant.robot.joint_count, plant.memory.x
    x[:3], x[7 + n : 10 + n], x[10 + n : 13 + n] = position, velocity, omega
    x[13 + n : 13 + 2 * n] = joint_rates
    update_true_state(plant.block, plant.tick, plant.period)


BODY: dict[str, Any] = {
    "name": "drifter",
    "mass": 80.0,
    "inertia": [6.0, 5.0, 4.0, 0.3, -0.2, 0.1],
    "place": {"position": [0.1, -0.05, 0.4], "quaternion": [0.8, 0.2, -0.4, 0.4]},
}


def target_of(**motion: Any) -> Target:
    """Return a target with a motion relative to the orbit."""
    return Target.from_dict({"target": {**BODY, "motion": {"relative_to": "orbit", **motion}}})


def tensor_of(target: Target) -> Array:
    """Return the inertia (3, 3) about the target's CoM, on its axes, kg m2."""
    return np.array(target.inertia)[[0, 3, 4, 3, 1, 5, 4, 5, 2]].reshape(3, 3)


def circular_orbit(height: float, **gravity: Any) -> OrbitSettings:
    """Return an inclined circular orbit."""
    elements = {"height": height, "inclination_deg": 51.6, "raan_deg": 40.0, "anomaly_deg": 75.0}
    return OrbitSettings.model_validate({"orbital_elements": elements, "gravity": gravity})


def held_place(robot: Robot, state: RobotState, target: Target) -> tuple[Array, Array]:
    """Return where a tool holds a target: its CoM (3,), m, and axes (3, 3), inertial axes.

    The robot's joints turn and have motors.
    """
    tool = robot.tool
    axes, origin = body_places(robot, state)[tool.body]
    hand, place = axes @ tool.rotation, target.place
    position = origin + axes @ tool.position + hand @ np.array(place.position)
    return position, hand @ rotation_of(place.quaternion).as_matrix()


def meeting_target(orbit: OrbitSettings, time: float, place: ArrayLike, **motion: Any) -> Target:
    """Return a target that is at ``place`` (3,), m, inertial axes, at ``time``, s.

    Its position at time 0 is corrected linearly until nothing is left of the miss.
    """
    position, step = np.zeros(3), 1.0

    def miss(start: Array) -> Array:
        target = target_of(**{**motion, "position": start.tolist()})
        return target_state(target, orbit, time).position - np.asarray(place)

    for _ in range(3):
        now = miss(position)
        slopes = [(miss(position + step * axis) - now) / step for axis in np.eye(3)]
        position = position - np.linalg.solve(np.column_stack(slopes), now)
    assert np.linalg.norm(miss(position)) < 1e-7
    return target_of(**{**motion, "position": position.tolist()})
