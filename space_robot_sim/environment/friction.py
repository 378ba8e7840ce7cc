"""Friction in joints and wheels, the last term of (27), set-valued at rest.

By Coulomb's law the friction torque of a moving joint is ``f_C sign(thetadot)``. At rest it is the
torque between ``-f_C`` and ``f_C`` that holds the joint (Filippov 1988). Which joints are at rest
is determined in `space_robot_sim.plant.integrator`; this module computes the friction then.
"""

from __future__ import annotations

from functools import partial
from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_model.dynamics.model import MOST_JOINTS, MOST_MOVING
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import uniform, whole
from space_robot_msgs_py.compiled.records import shaped
from space_robot_msgs_py.config.validation import StrictModel

from ..component import Component, Installation
from ..faults.grammar import About, Argument, Kind

Array = NDArray[np.float64]
Coefficient = Annotated[float, Field(ge=0.0, le=1e6)]


class FrictionSettings(StrictModel):
    """``f_f = f_C sign(thetadot) + f_V thetadot`` on every joint; ``|f_f| <= f_C`` at rest."""

    coulomb: Coefficient = Field(0.02, description="Coulomb friction f_C of each joint, N m or N")
    viscous: Coefficient = Field(
        0.2, description="viscous friction f_V of each joint, N m s/rad or N s/m"
    )
    set_valued: bool = Field(
        True,
        description="a joint at rest is held by up to f_C (false: sign(thetadot) inside the "
        "integration step, which causes chatter, as in simple simulators)",
    )


def coefficients(robot: Robot, settings: FrictionSettings) -> Array:
    """Return f_C and f_V (N, 2) of all joints: their own, or the settings'.

    N m and N m s/rad, N and N s/m of prismatic joints. Passive joints have their own only.
    """
    usual = np.zeros((robot.joint_count, 2))
    usual[: robot.n] = settings.coulomb, settings.viscous
    own = np.array(robot.friction).reshape(robot.joint_count, 2)
    return np.where(np.isnan(own), usual, own)


def _in_model_order(column: int, settings: FrictionSettings, at: Installation) -> Array:
    return np.asarray(coefficients(at.robot, settings)[list(at.robot.order), column])


class Friction(Component):
    """Friction of a robot's joints, then of its wheels."""

    count: float = shaped(lambda n: (), uniform=True, source=lambda s, at: at.robot.joint_count)
    """Number of joints and wheels; the rest of the arrays is unused."""
    row: Array = shaped(lambda n: (MOST_JOINTS,), source=lambda s, at: np.argsort(at.robot.order))
    """Row of each joint in the other arrays, which are in the order of `Model`."""
    coulomb: Array = shaped(lambda n: (MOST_MOVING,), source=partial(_in_model_order, 0))
    """f_C, N m."""
    viscous: Array = shaped(lambda n: (MOST_MOVING,), source=partial(_in_model_order, 1))
    """f_V, N m s/rad."""
    set_valued: float = shaped(lambda n: (), uniform=True, source="set_valued")
    """0 for the sign alone, 1 for friction that holds joints at rest."""

    FAULTS: ClassVar[tuple[Kind, ...]] = (
        Kind(
            "stuck_joint",
            Argument("TORQUE", "N m", 0.0, 1e3, About.JOINT),
            "a joint's Coulomb friction is raised to TORQUE",
            "coulomb",
            np.maximum,
            rows="row",
        ),
    )


@kernel
def friction_torque(friction: Friction, velocities: Array, directions: Array, out: Array) -> None:
    """Write into ``out`` the torque ``f_f`` that opposes the motion of each joint and wheel, N m.

    ``directions``: 1 or -1, the sense in which each turns or begins to turn; 0 at rest, where the
    holding torque is not computed.
    """
    for i in range(whole(friction.count)):
        rate = velocities[i]
        # the last term of (27); a joint at rest is locked in place of a torque that holds it
        direction = directions[i] if uniform(friction.set_valued) != 0.0 else np.sign(rate)
        out[i] = friction.coulomb[i] * direction + friction.viscous[i] * rate
