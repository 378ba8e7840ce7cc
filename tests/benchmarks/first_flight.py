"""A process that flies the first ticks of a robot: ``python -m benchmarks.first_flight JOINTS``."""

from __future__ import annotations

import sys

import numpy as np
from strategies import random_robot

from space_robot.flight.closed_loop import close_loop
from space_robot_control.controller.controller import Controller
from space_robot_control.laws import find_law
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase
from space_robot_sim.plant.plant import Plant, PlantSettings

LAWS = ("tde_stc", "ctc")
"""One with the time-delay estimate, one with the model."""
TICKS = 2
TIMEBASE = Timebase(500_000)


def fly(joints: int) -> None:
    """Fly ticks in compiled code, and one as the nodes do, under either law."""
    robot = random_robot(np.random.default_rng(joints), joints)
    for name in LAWS:
        law = find_law(name)
        ones = {gain: np.ones(joints + 3) for gain in law.gain_descriptions()}
        plant = Plant(robot, PlantSettings(initial_joints_deg=[0.0] * joints), TIMEBASE.period)
        controller = Controller(robot, law(ones, TIMEBASE.period), TIMEBASE.period)
        log = FlightLog.allocate(TICKS, robot.joint_names, TIMEBASE)
        log.commanded_torque = np.zeros_like(log.applied_torque)
        log.telemetry = np.zeros((TICKS, 4, log.axes))
        log.reference_joints[:] = log.reference_base[:] = 0.0
        log.reference_base[:, 0] = 1.0
        close_loop(plant, controller, log, 0, TICKS)
        plant.step(controller.update(plant.state, log.references(0, 1)))


if __name__ == "__main__":
    fly(int(sys.argv[1]))
