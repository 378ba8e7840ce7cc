"""The flights of a sweep: every law with all sensors and actuators under every draw of masses."""

from __future__ import annotations

import itertools
from collections.abc import Iterator
from dataclasses import replace
from typing import Annotated, Any, NamedTuple

import numpy as np
from pydantic import Field

from space_robot_msgs_py.config.validation import StrictModel
from space_robot_sim.robot import Robot
from space_robot_sim.robot.find import find_robot, robot_as_path

from ...flight.plan import FlightPlan
from ..study import Law


class Draw(NamedTuple):
    """One flight of a sweep."""

    law: Law
    sensors: str
    number: int
    """The same robot and noise for all laws, sensors and actuators."""
    actuators: str = "ideal"


class Sweep(StrictModel):
    """What a sweep flies."""

    laws: list[Law]
    sensors: list[str]
    actuators: list[str] = Field(default_factory=lambda: ["ideal"])
    draws: Annotated[int, Field(ge=1, le=100_000)] = 1
    """Flights of every law with every sensors and actuators."""
    spread: Annotated[float, Field(ge=0.0, lt=1.0)] = 0.0
    """Largest relative error of every mass and inertia; 0: the nominal robot."""
    seed: Annotated[int, Field(ge=0, le=2**30)] = 0
    common: dict[str, Any] = Field(default_factory=dict)
    """Options of `FlightPlan` that all flights share."""

    def flights(self) -> Iterator[Draw]:
        """Yield every flight: laws of one hardware and draw follow one another."""
        for actuators, sensors in itertools.product(self.actuators, self.sensors):
            for index in range(self.draws):
                for law in self.laws:
                    yield Draw(law, sensors, index, actuators)

    def plan(self, draw: Draw) -> FlightPlan:
        """Return the plan of a flight; the plant alone is the robot of the draw."""
        law, sensors, number, actuators = draw
        return FlightPlan(
            controller=law.controller, gains=law.gains, sensors=sensors, actuators=actuators,
            seed=self.seed + number, plant_robot=self.robot(number), **self.common,
        )  # fmt: skip

    def robot(self, index: int) -> Robot | None:
        """Return the robot of a draw: every mass and inertia off by a factor.

        A body's inertia is scaled as a whole, so it stays one that a body can have. None: the
        nominal robot.
        """
        if not self.spread:
            return None
        given: str | Robot = self.common.get("robot", "paper")
        nominal = given if isinstance(given, Robot) else find_robot(robot_as_path(given))
        rng = np.random.default_rng((self.seed, index))
        bodies = [0, *(joint + 1 for joint in nominal.order)]
        factors = rng.uniform(1.0 - self.spread, 1.0 + self.spread, (len(bodies), 2))
        mass, inertia = nominal.mass.copy(), nominal.inertia.copy()
        mass[bodies] *= factors[:, 0]
        inertia[bodies] *= factors[:, 1, np.newaxis, np.newaxis]
        return replace(nominal, mass=mass, inertia=inertia)
