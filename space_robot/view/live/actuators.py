"""Wheels and plumes in the live scene of a flight."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot

from ..actuators import drawing_notes
from ..plumes import DrawnPlumes
from ..scene import RobotScene
from ..wheels import DrawnWheels, at_limit, slowdown_of

if TYPE_CHECKING:
    from viser import SceneApi

    from .listener import Sample

Array = NDArray[np.float64]

UNLIMITED = 600.0
"""Largest speed of a wheel without a limit, rad/s: about 6000 rpm."""


class LiveActuators:
    """The actuators of a robot's base."""

    def __init__(
        self,
        scene: SceneApi,
        robot_scene: RobotScene,
        robot: Robot,
        actuators: BaseActuatorSettings,
        dark: bool,
    ) -> None:
        """Draw them.

        Args:
            scene: of a server.
            robot_scene: the robot in it.
            robot: of the flight.
            actuators: of its base.
            dark: whether the page is light on dark.
        """
        wheels, thrusters = actuators.wheels, actuators.thrusters
        self._settings = wheels
        self._wheels = DrawnWheels(scene, robot_scene, robot, wheels) if wheels.count else None
        self._plumes = (
            DrawnPlumes(scene, robot_scene, robot, thrusters, dark) if thrusters.count else None
        )
        self._angles, self._time = np.zeros(wheels.count), np.inf
        speeds = np.minimum(
            wheels.limits("max_momentum") / wheels.values("rotor_inertia"), UNLIMITED
        )
        self._slowdown = slowdown_of(float(speeds.max(initial=0.0)))
        self.notes = drawing_notes(actuators, self._slowdown)
        """How they are drawn, a sentence each."""

    def move(self, sample: Sample) -> None:
        """Show those of a sample; between two samples wheels turn with the speed of the second."""
        if self._wheels:
            speeds, torques = sample.wheels
            self._angles += speeds * (max(sample.time - self._time, 0.0) / self._slowdown)
            self._time = sample.time
            self._wheels.move(self._angles, at_limit(self._settings, speeds, torques))
        if self._plumes:
            self._plumes.move(sample.thrusts)
