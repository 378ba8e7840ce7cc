"""Flight logs with random numbers, for properties that hold of any flight."""

from __future__ import annotations

import numpy as np

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

TIMEBASE = Timebase(500_000)
LIMITS = {"base_torque_limit": 2.0, "joint_torque_limit": 1.5}


def random_log(
    n: int, ticks: int, seed: int, latency_ticks: int = 0, wall_clock: bool = False
) -> FlightLog:
    """States and torques at random, every number another, at a rest every now and then.

    Commands are applied as told, clipped to `LIMITS`, but for some; the quaternion jumps between Q
    and -Q, the desired one too.
    """
    rng = np.random.default_rng(seed)
    log = FlightLog.allocate(ticks, tuple(f"j{i}" for i in range(n)), TIMEBASE)
    for name in ("base_position", "base_velocity", "omega_base", "joint_velocities"):
        column = getattr(log, name)
        column[:] = rng.normal(size=column.shape)
    quaternion = np.array([1.0, 0.0, 0.0, 0.0]) + 0.1 * rng.normal(size=(ticks, 4))
    quaternion /= np.linalg.norm(quaternion, axis=1, keepdims=True)
    log.quaternion[:] = quaternion * rng.choice([-1.0, 1.0], size=(ticks, 1))
    log.reference_base[:] = 0.0
    desired = quaternion + 1e-5 * rng.normal(size=(ticks, 4))
    desired /= np.linalg.norm(desired, axis=1, keepdims=True)
    log.reference_base[:, :4] = desired * rng.choice([-1.0, 1.0], size=(ticks, 1))
    log.reference_joints[:] = rng.normal(size=(ticks, 3, n))
    for rest in rng.choice(ticks, size=ticks // 12 + 1, replace=False):
        log.reference_joints[rest : rest + int(rng.integers(1, 4)), 1] = 0.0
    log.joint_positions[:] = log.reference_joints[:, 0] + 1e-5 * rng.normal(size=(ticks, n))
    log.commanded_torque = rng.normal(size=(ticks, n + 3))
    limit = np.array([2.0] * 3 + [1.5] * n)
    log.applied_torque[:] = rng.normal(size=(ticks, n + 3))
    delay = latency_ticks + 1
    due = log.commanded_torque[: max(0, ticks - delay)]
    log.applied_torque[ticks - len(due) :] = np.clip(due, -limit, limit)
    held = rng.random(ticks) < 0.1
    log.applied_torque[held] *= 0.5
    log.commanded_torque[rng.random(ticks) < 0.1] = np.nan
    if wall_clock:
        log.latency_s = np.where(rng.random(ticks) < 0.2, np.nan, rng.exponential(3e-4, ticks))
    log.flight = {
        "controller": "tde_stc",
        "gains_used": {"h_bar": rng.uniform(0.5, 50.0, n + 3).tolist()},
        "command_latency_ticks": latency_ticks,
        "parameters": {"plant": LIMITS},
    }
    return log
