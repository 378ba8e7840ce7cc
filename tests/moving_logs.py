"""Logs whose rows all differ."""

from __future__ import annotations

import numpy as np
from scipy.spatial.transform import Rotation

from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase


def moving_log(
    robot: Robot, ticks: int, first_tick: int = 0, period_ns: int = 500_000
) -> FlightLog:
    """A log whose rows all differ, and tell their numbers: x of the base is the row."""
    log = FlightLog.allocate(
        ticks, robot.joint_names, Timebase(period_ns), passive_names=robot.passive_names
    )
    log.first_tick = first_tick
    rng = np.random.default_rng(ticks + first_tick)
    log.base_position[:] = np.column_stack([np.arange(ticks), np.zeros((ticks, 2))])
    log.quaternion[:] = Rotation.random(ticks, rng=rng).as_quat()
    log.joint_positions[:] = rng.uniform(-3.0, 3.0, log.joint_positions.shape)
    log.passive_positions[:] = 0.0
    log.reference_base[:, :4] = Rotation.random(ticks, rng=rng).as_quat()
    log.reference_joints[:, 0] = log.joint_positions + 0.1
    return log
