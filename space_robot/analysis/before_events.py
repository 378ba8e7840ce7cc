"""State just before a capture or release, computed from the state after it."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

import numpy as np

from space_robot_model.elementary.matrices import norm, product
from space_robot_model.hardware.wheels import WheelSettings
from space_robot_model.robot.base_axes import base_axes
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.environment.captures import CaptureEvent


def state_before(exchange: CaptureEvent, row: FlightLog, wheels: WheelSettings) -> FlightLog:
    """Return the one row of an event's tick with the velocities that led to those it has.

    Args:
        exchange: the event; of several at one tick the last one.
        row: the truth at its tick, when it has happened.
        wheels: of the base.
    """
    n, p = len(row.joint_names), len(row.passive_names)
    quaternion = row.quaternion[0] / norm(row.quaternion[0])
    axes = base_axes(quaternion[:, np.newaxis])[:, :, 0]
    impact = exchange.impact(
        quaternion, row.all_positions[0], wheels.unit_axes, wheels.values("rotor_inertia")
    )
    after = np.concatenate(
        [
            row.base_velocity[0],
            product(row.omega_base[0], axes),
            row.all_velocities[0],
            row.wheel_velocities[0],
        ]
    )
    before = exchange.velocity_before(impact, after)
    columns: dict[str, Any] = {
        "base_velocity": before[:3],
        "omega_base": product(axes, before[3:6]),
        "joint_velocities": before[6 : 6 + n],
        "passive_velocities": before[6 + n : 6 + n + p],
        "wheel_velocities": before[6 + n + p :],
    }
    return replace(row, **{name: values[np.newaxis] for name, values in columns.items()})
