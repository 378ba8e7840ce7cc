"""Small motions under a gain set along the whole mission, of which trials fly the beginning."""

from __future__ import annotations

import numpy as np

from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.guidance.mission import Mission
from space_robot_control.laws.base import ControlLaw
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_sim.environment.friction import coefficients

from ..flight.plan import Flight
from ..tuning.closed_loop import SLOWEST_GROWTH, RigidLoop
from ..tuning.gain_check import pair_corner
from ..tuning.inertia import inertia_along, postures_along
from ..tuning.linear_law import linear_laws

POSTURES = 6
"""Parts of the mission; the loop is closed at the ends of each."""


class SmallMotions:
    """Those of the robot of one flight, with viscous friction."""

    def __init__(self, flight: Flight, gain: float, friction: float, is_late: bool) -> None:
        """Compute the motions in some postures.

        Args:
            flight: the nominal one.
            gain: factor on the actual torque up to which the loop has to be stable.
            friction: share of the nominal friction.
            is_late: whether it has to be so with commands a tick late, too.
        """
        robots, mission = flight.scenario.robots, flight.mission_settings
        duration = Mission(robots.controller, mission, flight.period).duration
        step, has_base = max(1.0, duration / POSTURES), flight.controls_base
        self._postures = postures_along(robots.controller, mission, step, has_base)
        self._inertia = inertia_along(flight.plant.robot, mission, step, has_base)
        known = coefficients(robots.controller, flight.plant_settings.friction)[:, 1]
        self._damping = np.zeros(self._inertia.shape[-1])
        self._damping[-robots.controller.n :] = friction * known[: robots.controller.n]
        self._gain, self._is_late, self._settings = gain, is_late, flight.controller_settings

    def growth(self, law: ControlLaw, corner_hz: float) -> float:
        """Return by how much the fastest one grows, 1/s, also with more torque, and late.

        Args:
            law: with its gains.
            corner_hz: of the low-pass of its estimate; 0: none.
        """
        update = {"acceleration_filter_hz": corner_hz}
        settings: ControllerNodeSettings = self._settings.model_copy(update=update)
        weight = low_pass_weight(pair_corner(settings), law.period) or 1.0
        linear = linear_laws(law, self._postures)
        sets = len(self._inertia) // len(linear)
        loop = RigidLoop(self._inertia, self._postures * sets, linear * sets, weight, self._damping)
        fastest = max(loop.radius(), loop.radius(1.0, self._gain, self._is_late))
        return (fastest - 1.0 - SLOWEST_GROWTH) / law.period
