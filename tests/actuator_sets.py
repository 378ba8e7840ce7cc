"""Sets of wheels and thrusters, and logs of bases that they turned, for tests."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

Array = NDArray[np.float64]
IDEAL = BaseActuatorSettings()
PYRAMID = [1.0, 1.0, 1.0, -1.0, 1.0, 1.0, -1.0, -1.0, 1.0, 1.0, -1.0, 1.0]
"""Axes of four wheels."""


def flat(vectors: ArrayLike) -> list[float]:
    """Vectors as a parameter has them."""
    values: list[float] = np.ravel(vectors).tolist()
    return values


def hardware(**parts: dict[str, Any]) -> BaseActuatorSettings:
    """Wheels, thrusters or both."""
    return BaseActuatorSettings.model_validate({"base_actuation": "hardware", **parts})


def random_thrusters(rng: np.random.Generator, count: int) -> BaseActuatorSettings:
    """Thrusters anywhere, in pairs that turn the base either way."""
    places, directions = rng.uniform(-2.0, 2.0, (count, 3)), rng.normal(size=(count, 3))
    return hardware(
        thrusters={
            "positions": flat([places, places]),
            "directions": flat([directions, -directions]),
            "force": flat(rng.uniform(1.0, 10.0, 2 * count)),
            "specific_impulse": flat(rng.uniform(100.0, 300.0, 2 * count)),
        }
    )


def still_log(
    robot: Robot, ticks: int, actuators: BaseActuatorSettings = IDEAL, period: float = 0.0005
) -> FlightLog:
    """A flight in which nothing moves and nothing is asked, described as a bag has it."""
    log = FlightLog.allocate(
        ticks,
        robot.joint_names,
        Timebase(round(1e9 * period)),
        actuators.wheel_count,
        actuators.thruster_count,
    )
    for column in log.columns.values():
        column[:] = 0.0
    log.quaternion[:, 0] = log.reference_base[:, 0] = 1.0
    log.commanded_torque = np.zeros_like(log.applied_torque)
    log.flight = {"controller": "tde_stc", "case": "1", "robot": robot.name, "actuators": "mine"}
    if actuators.base_actuation != "ideal":
        log.flight["base_actuators"] = actuators.model_dump()
    return log
