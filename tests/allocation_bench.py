"""The allocation alone, of a base that does not turn; layouts of wheels and thrusters."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import linprog

from space_robot_control.allocation.allocation import Allocation, allocation_code
from space_robot_control.allocation.settings import AllocationSettings
from space_robot_control.allocation.wheel_set import WheelSet, least_largest, tabulate
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_msgs_py.compiled.kernels import RecordFunction
from space_robot_msgs_py.samples import MOST_WHEELS, State

PERIOD = 5e-4
INERTIA = 0.02
PYRAMID = np.array([[1, 0, 0.7], [0, 1, 0.7], [-1, 0, 0.7], [0, -1, 0.7]])


@cache
def allocate() -> RecordFunction:
    return allocation_code(is_used=True)


def unit(axes: Array) -> Array:
    return np.asarray(axes / np.linalg.norm(axes, axis=1, keepdims=True))


def wheel_set(axes: Array, loads: ArrayLike = 1.0, out: tuple[int, ...] = ()) -> WheelSet:
    """Tables of wheels with some axes (of any length) and full loads, but for those ``out``."""
    wheels, axis, count = WheelSet.allocate(1), np.zeros((MOST_WHEELS, 3)), len(axes)
    axis[:count] = unit(axes)
    wheels.full_load[:] = 1.0
    wheels.full_load[:count] = loads
    wheels.takes_part[:count] = 1.0
    wheels.takes_part[list(out)] = 0.0
    tabulate(wheels, axis, count)
    return wheels


def loads_of(axes: Array, full: Array, wanted: Array, out: tuple[int, ...] = ()) -> Array:
    torque = np.zeros(MOST_WHEELS)
    least_largest(wheel_set(axes, full, out), len(axes), tuple(wanted), torque)
    return np.asarray(torque[: len(axes)] / full)


def least(axes: Array, full: Array, wanted: Array) -> float:
    """By linear programming: min t with A u = wanted, -t <= u_k / full_k <= t."""
    count = len(axes)
    columns = np.hstack([unit(axes).T * full, np.zeros((3, 1))])
    bounds = np.vstack([np.hstack([s * np.eye(count), -np.ones((count, 1))]) for s in (1, -1)])
    found = linprog(
        np.append(np.zeros(count), 1.0),
        A_ub=bounds,
        b_ub=np.zeros(2 * count),
        A_eq=columns,
        b_eq=wanted,
        bounds=[(None, None)] * count + [(0, None)],
        method="highs",
    )
    assert found.success
    return float(found.fun)


def couples(force: float = 1.0, shortest_pulse: float = 0.01) -> dict[str, Any]:
    """Twelve thrusters, 1 m from the CoM, in pairs of pure couples about each axis."""
    positions, directions = [], []
    for axis in range(3):
        for arm, side in ((1, 1), (1, -1), (-1, 1), (-1, -1)):
            positions.append(arm * np.eye(3)[axis])
            directions.append(side * np.eye(3)[(axis + 1) % 3])
    return {
        "positions": np.ravel(positions).tolist(),
        "directions": np.ravel(directions).tolist(),
        "force": [force],
        "shortest_pulse": [shortest_pulse],
    }


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
        largest_dipole: float = 0.0,
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
        if largest_dipole:
            torquers = {"axes": np.eye(3).ravel().tolist(), "max_dipole": [largest_dipole]}
            hardware["magnetic_torquers"] = torquers
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

    def step(self, demand: Any, field: Any = 0.0) -> Array:
        """Return the torque that the base got over a tick."""
        state = self.state
        state.wheel_velocities[: self.count] = self.momenta / self.inertia
        allocation = self.allocation
        allocation.reported_speeds[:] = state.wheel_velocities
        allocation.reported_torques[:] = state.wheel_torques
        allocation.demand[:] = demand
        allocation.torquers.magnetic_field[:] = field
        # as flights call it: so it is not compiled once more
        allocate().call(np.asarray(allocation).ctypes.data, 0, float(self.tick))
        first = self.count + self.thruster_count
        self.command = command = allocation.command[:first].copy()
        self.dipoles = allocation.command[first : first + 3].copy()
        self.of_torquers = np.cross(self.dipoles, allocation.torquers.magnetic_field)
        self._late.append(command[: self.count].copy())
        given = self._late.pop(0)
        given[list(self.failed)] = 0.0
        self.momenta += given * PERIOD
        state.wheel_torques[: self.count] = given
        self.tick += 1
        opened = command[self.count :] > 0.0
        return np.asarray(opened @ self.torques - given @ self.axes + self.of_torquers)

    def fly(self, demand: Any, ticks: int) -> Array:
        return np.array([self.step(demand) for _ in range(ticks)])
