"""The allocation alone, of a base that does not turn."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray
from wheel_layouts import PYRAMID

from space_robot_control.allocation.allocation import Allocation, allocate
from space_robot_control.allocation.settings import AllocationSettings
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.samples import State

Array = NDArray[np.float64]

PERIOD = 5e-4
INERTIA = 0.02


class AllocationBench:
    """A base that does not turn, whose wheels do: momentum is inertia times speed."""

    def __init__(
        self,
        axes: Any = PYRAMID,
        thrusters: Any = None,
        momenta: Any = 0.0,
        latency: int = 0,
        wheels: Any = None,
        sharing: str = "pseudo_inverse",
        **settings: Any,
    ) -> None:
        hardware: dict[str, Any] = {"base_actuation": "hardware"}
        if axes is not None:
            hardware["wheels"] = {
                "axes": np.ravel(axes).tolist(),
                "rotor_inertia": [INERTIA],
                "max_torque": [1.0],
                "max_momentum": [20.0],
                **(wheels or {}),
            }
        if thrusters:
            hardware["thrusters"] = thrusters
        assumed = BaseActuatorSettings(**hardware)
        self.count, self.thruster_count = assumed.wheel_count, assumed.thruster_count
        self.axes, self.torques = assumed.wheels.unit_axes, assumed.thrusters.torques
        self.allocation = Allocation.build(
            1, assumed, AllocationSettings(wheels=sharing, **settings), PERIOD
        )
        self.inertia = assumed.wheels.values("rotor_inertia") if self.count else np.empty(0)
        self.state = State.allocate(1)
        self.momenta = np.zeros(self.count) + momenta
        self.failed: set[int] = set()
        self.tick = 0
        self._late = [np.zeros(self.count)] * latency

    def step(self, demand: Any) -> Array:
        """Return the torque that the base got over a tick."""
        state = self.state
        state.wheel_velocities[: self.count] = self.momenta / self.inertia
        allocation = self.allocation
        allocation.reported_speeds[:] = state.wheel_velocities
        allocation.reported_torques[:] = state.wheel_torques
        allocation.demand[:] = demand
        allocate(allocation, float(self.tick))
        self.command = command = allocation.command[: self.count + self.thruster_count].copy()
        self._late.append(command[: self.count].copy())
        given = self._late.pop(0)
        given[list(self.failed)] = 0.0
        self.momenta += given * PERIOD
        state.wheel_torques[: self.count] = given
        self.tick += 1
        opened = command[self.count :] > 0.0
        return np.asarray(opened @ self.torques - given @ self.axes)

    def fly(self, demand: Any, ticks: int) -> Array:
        return np.array([self.step(demand) for _ in range(ticks)])
