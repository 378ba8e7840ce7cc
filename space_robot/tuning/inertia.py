"""The semi-floating inertia H_S (28) in many configurations at once.

The base floats freely, so its translation is eliminated. The remaining kinetic energy is that about
the common CoM of the robot,

    H_r = sum_i  Jw_i^T I_i Jw_i + m_i (Jv_i - Jv_c)^T (Jv_i - Jv_c),    H_S = J^-T H_r J^-1,

with the Jacobians of body i's angular velocity and CoM, Jv_c their mass-weighted mean, and
J = blkdiag(J0, E) of (22). The base is at its desired attitude, where ``J0 = E / 2``. Without
attitude actuators the base's rotation is eliminated, too, and the inertia of the joints is

    H_f = H_MM - H_MB H_BB^-1 H_BM,    the inverse of the joints' part of H_S^-1.

By Cauchy's interlacing theorem the eigenvalues of ``H_f^-1 h_bar`` lie between the extreme ones of
``H_S^-1 h_bar``: the time-delay estimate has at least the margin of a controlled base.
`rho_space_into` computes H_S from composite bodies for one configuration per call; this module
needs no compiled code, whose loading takes time.
"""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np

from space_robot_control.guidance.courses import FEWEST_KNOTS
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.placements import BodyFrame, body_frames
from space_robot_msgs_py.samples import ReferenceChunk

SAMPLING = 0.05
"""Time between two evaluated configurations, s; a leg of a mission takes seconds."""
J0 = 0.5
"""J0 of (1) without attitude error, times the unit matrix: epsdot_e = J0 omega_e."""
MOST_SAMPLES = 20_000
"""Largest number of configurations at equal distances."""


def sampled_reference(
    robot: Robot, settings: MissionSettings, step: float = SAMPLING
) -> ReferenceChunk:
    """Return the reference of a mission every ``step`` s, including the last waypoint.

    Of a long mission every part is sampled as often as the others.
    """
    mission = Mission(robot, settings, step)
    if (count := int(np.ceil(mission.duration / step - 1e-9)) + 1) <= MOST_SAMPLES:
        return mission.chunk(0, count)
    times = [np.linspace(part.begin, part.end, FEWEST_KNOTS) for part in mission.pieces]
    pairs = list(zip(mission.pieces, times, strict=True))
    return ReferenceChunk(
        0,
        np.concatenate([part.joints.at(time) for part, time in pairs]),
        np.concatenate([part.base.at(time) for part, time in pairs]),
    )


def inertia_along(
    robot: Robot, settings: MissionSettings, step: float = SAMPLING, controls_base: bool = True
) -> Array:
    """Return H_S (K, m, m) of ``robot`` along a mission's reference, every ``step`` s.

    For a base without attitude actuators: H_f (K, n, n). A robot with passive joints has every
    configuration twice: with these joints locked (slow motion) and free (within a tick).

    Args:
        robot: with its payload, if any.
        settings: of the mission; its last waypoint is included.
        step: between configurations, s.
        controls_base: whether the base has attitude actuators.
    """
    chunk = sampled_reference(robot, settings, step)
    inertia = semi_floating_inertia(robot.nominal, chunk.joints[:, 0])
    if robot.springs:
        inertia = np.concatenate([inertia, loose_inertia(robot, chunk.joints[:, 0])])
    return inertia_in_rho(inertia) if controls_base else free_inertia(inertia)


def free_inertia(inertia: Array) -> Array:
    """Return H_f (K, n, n) from H_r or H_S (K, m, m)."""
    share = np.linalg.solve(inertia[:, :3, :3], inertia[:, :3, 3:])
    left: Array = inertia[:, 3:, 3:] - inertia[:, 3:, :3] @ share
    return left


def loose_inertia(robot: Robot, joint_positions: Array) -> Array:
    """Return ``H_aa - H_ap H_pp^-1 H_pa`` (K, m, m) of H_r with the passive joints p at rest.

    This is the inertia of the actuated axes a in motion that is fast compared with the springs.

    Args:
        robot: with passive joints.
        joint_positions: (K, n) of the actuated joints, rad or m.
    """
    count, m = len(joint_positions), robot.n + 3
    rest = np.broadcast_to([spring.rest for spring in robot.springs], (count, len(robot.springs)))
    whole = semi_floating_inertia(robot, np.hstack([joint_positions, rest]))
    share = np.linalg.solve(whole[:, m:, m:], whole[:, m:, :m])
    left: Array = whole[:, :m, :m] - whole[:, :m, m:] @ share
    return left


def inertia_in_rho(inertia: Array) -> Array:
    """Return ``J^-T H_r J^-1`` (K, m, m) for H_r = ``inertia`` (K, m, m) of a base as desired."""
    scale = np.ones(inertia.shape[-1])
    scale[:3] = 1.0 / J0
    moved: Array = scale[:, np.newaxis] * inertia * scale
    return moved


def semi_floating_inertia(robot: Robot, joint_positions: Array) -> Array:
    """Return H_r (K, N+3, N+3) about the base's axes for all ``joint_positions`` (K, N).

    Positions are in rad, or m for prismatic joints; passive joints come last.
    """
    count, n = joint_positions.shape
    angular = np.zeros((n + 1, count, 3, n + 3))
    linear = np.zeros_like(angular)
    still = np.repeat(np.eye(3)[:, :, np.newaxis], count, axis=2)
    frames: dict[int, BodyFrame] = {}
    for frame in body_frames(robot, still, joint_positions.T):
        body = frame.body
        frames[body] = frame
        com = (frame.origin + frame.on_outer_axes(robot.com[body])).T
        angular[body, :, :, :3] = np.eye(3)
        linear[body, :, :, :3] = np.cross(np.eye(3), com[:, np.newaxis, :]).swapaxes(1, 2)
        mover = body
        while mover:  # every joint on the path to the base
            joint, axis = mover - 1, frames[mover].z.T
            if robot.is_prismatic[joint]:
                linear[body, :, :, 3 + joint] = axis
            else:
                angular[body, :, :, 3 + joint] = axis
                linear[body, :, :, 3 + joint] = np.cross(axis, com - frames[mover].origin.T)
            mover = int(robot.parent[joint])
        # from here in the body's axes, in which its inertia is constant
        angular[body] = np.stack((frame.x.T, frame.y.T, frame.z.T), axis=1) @ angular[body]
    linear -= np.tensordot(robot.mass / robot.mass.sum(), linear, axes=1)
    turning = angular.swapaxes(2, 3) @ robot.inertia[:, np.newaxis] @ angular
    moving = linear.swapaxes(2, 3) @ (robot.mass[:, np.newaxis, np.newaxis, np.newaxis] * linear)
    total: Array = (turning + moving).sum(axis=0)
    return total


class Posture(NamedTuple):
    """A configuration of the robot as the controller knows it, the base as desired."""

    robot: Robot
    """Without payload, passive joints and gears."""
    joints: Array
    """(n,) rad or m."""
    inertia: Array
    """(m, m) H_S; (n, n) H_f of the joints for a base without attitude actuators."""

    @property
    def axes(self) -> int:
        """The number of axes that are controlled, the last ones of a law."""
        return len(self.inertia)


def postures_at(
    robot: Robot, joint_positions: Iterable[Array], controls_base: bool = True
) -> list[Posture]:
    """Return the postures of the nominal ``robot`` for ``joint_positions`` (K, n), rad or m."""
    nominal, positions = robot.nominal, np.asarray(joint_positions)
    inertia = semi_floating_inertia(nominal, positions)
    inertia = inertia_in_rho(inertia) if controls_base else free_inertia(inertia)
    return [Posture(nominal, *pair) for pair in zip(positions, inertia, strict=True)]


def postures_along(
    robot: Robot, settings: MissionSettings, step: float, controls_base: bool = True
) -> list[Posture]:
    """Return the postures of the nominal ``robot`` every ``step`` s of a mission."""
    chunk = sampled_reference(robot, settings, step)
    return postures_at(robot, chunk.joints[:, 0], controls_base)
