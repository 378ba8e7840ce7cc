"""The forces that a mission asks for: inverse dynamics along its reference."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import astuple, dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.dynamics.attitude import rotation_matrix
from space_robot_model.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_model.robot import Robot
from space_robot_sim.environment.disturbance import Disturbance, disturbance_torque
from space_robot_sim.environment.environment import EnvironmentSettings
from space_robot_sim.environment.friction import coefficients
from space_robot_sim.environment.payload import with_payload

from .inertia import SAMPLING, attitude_jacobian, sampled_reference

Array = NDArray[np.float64]
NOTHING = 1e-9
"""Of the largest acceleration asked of an axis: less is rounding."""


@dataclass(frozen=True)
class ForceDemand:
    """Generalised forces F_S that hold a mission's reference, per axis (m,), N m."""

    peak: Array
    """Largest |F_S| over all environments."""
    slope: Array
    """Largest |dF_S/dt|, Coulomb friction left out, which jumps; N m/s."""
    unknown: Array
    """Largest difference from the nominal robot's, alone in space."""
    nominal: Array
    """Largest |F_S| of the nominal robot, alone in space."""

    def on_all_axes(self, inertia: Array) -> ForceDemand:
        """Return the same with a demand on the axes that the mission asks nothing of.

        A motion in a plane leaves some axes alone; gains of zero would as well. They count as if
        they were asked for the smallest acceleration of all others. ``inertia``: (m,) of each axis.
        """
        return ForceDemand(*(_filled(force, inertia) for force in astuple(self)))


def _filled(force: Array, inertia: Array) -> Array:
    acceleration = force / inertia
    is_asked = acceleration > NOTHING * acceleration.max()
    least = np.min(acceleration, where=is_asked, initial=np.inf)
    return np.where(is_asked, force, inertia * least) if is_asked.any() else force


def demand(
    robot: Robot, mission: MissionSettings, cases: Sequence[EnvironmentSettings]
) -> ForceDemand:
    """Return what the mission asks for in any of the ``cases``.

    Args:
        robot: the nominal one.
        mission: its reference.
        cases: environments with friction, disturbance and payload.

    Raises:
        InputError: the waypoints do not fit the times or the joints.
    """
    nominal = _smooth_force(robot, mission)
    smooth = [_smooth_force(with_payload(robot, case.payload), mission, case) for case in cases]
    coulomb = [_coulomb(robot, mission, case) for case in cases]
    whole = [force + friction for force, friction in zip(smooth, coulomb, strict=True)]
    slopes = [np.abs(np.diff(force, axis=0)).max(axis=0) / SAMPLING for force in smooth]
    return ForceDemand(
        peak=np.max([np.abs(force).max(axis=0) for force in whole], axis=0),
        slope=np.max(slopes, axis=0),
        unknown=np.max([np.abs(force - nominal).max(axis=0) for force in whole], axis=0),
        nominal=np.abs(nominal).max(axis=0),
    )


def _smooth_force(
    robot: Robot, settings: MissionSettings, case: EnvironmentSettings | None = None
) -> Array:
    """Return F_S (K, m) every `SAMPLING` s, without Coulomb friction; passive joints locked."""
    robot = robot.nominal
    chunk = sampled_reference(robot, settings)
    count = len(chunk.joints)
    quaternion, still = chunk.base[0, :4], np.zeros(3)
    to_force = np.linalg.inv(attitude_jacobian(quaternion)).T
    rotation, model = np.empty((3, 3)), RhoSpaceModel.allocate(robot.n)
    rotation_matrix(quaternion, rotation)
    disturbance = Disturbance.build(robot.n, case.disturbance) if case else None
    force, torque = np.empty((count, robot.n + 3)), np.zeros(robot.n + 3)
    viscous = coefficients(robot, case.friction)[:, 1] if case else np.zeros(robot.n)
    for k, (theta, rates, accelerations) in enumerate(chunk.joints):
        rho_space_into(robot.model, quaternion, theta, still, rates, model)
        force[k] = model.inertia[:, 3:] @ accelerations + model.bias
        if case and disturbance is not None:
            disturbance_torque(disturbance, k * SAMPLING, torque)
            force[k, :3] += to_force @ rotation.T @ torque[:3]
            force[k, 3:] += torque[3:] + viscous * rates
    return force


def _coulomb(robot: Robot, settings: MissionSettings, case: EnvironmentSettings) -> Array:
    rates = sampled_reference(robot, settings).joints[:, 1]
    force = np.zeros((len(rates), robot.n + 3))
    force[:, 3:] = coefficients(robot, case.friction)[: robot.n, 0] * np.sign(rates)
    return force
