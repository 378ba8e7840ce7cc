"""Postures of the nominal robot along a mission, in which laws are linearised."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_control.guidance.mission import MissionSettings
from space_robot_model.robot import Robot

from .inertia import free_inertia, inertia_in_rho, sampled_reference, semi_floating_inertia

Array = NDArray[np.float64]


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
    """Return the postures of the nominal ``robot`` every ``step`` s of a mission.

    Raises:
        InputError: the waypoints do not fit the times or the joints.
    """
    chunk = sampled_reference(robot, settings, step)
    return postures_at(robot, chunk.joints[:, 0], controls_base)
