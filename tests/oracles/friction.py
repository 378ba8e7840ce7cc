"""Coulomb's law: joints at rest by trying all combinations, flights from event to event."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from strategies import State

from oracles import pinocchio_bias_force, pinocchio_mass_matrix, rotation_of
from oracles.rotors import RotorEquations
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot


def solutions(robot: Robot, state: State, torque: Array, coulomb: float) -> list[Array]:
    """All friction torques (n,) that obey Coulomb's law, found by trying every combination."""
    n = robot.n
    inverse = np.linalg.inv(pinocchio_mass_matrix(robot, state))
    turned = rotation_of(state.quaternion).apply(torque[:3])
    force = np.concatenate([np.zeros(3), turned, torque[3:]])
    free = inverse @ (force - pinocchio_bias_force(robot, state))
    found = []
    choices = [(np.sign(rate),) if rate else (-1.0, 0.0, 1.0) for rate in state.rate]
    for senses in map(np.array, itertools.product(*choices)):
        friction = coulomb * senses
        stands = senses == 0.0
        joints = inverse[6:, 6:]
        rest = free[6:] - joints[:, ~stands] @ friction[~stands]
        friction[stands] = np.linalg.solve(joints[np.ix_(stands, stands)], rest[stands])
        acceleration = free[6:] - joints @ friction
        leaves = (state.rate == 0.0) & ~stands
        if (np.abs(friction[stands]) <= coulomb + 1e-12).all() and (
            acceleration[leaves] * senses[leaves] >= -1e-12
        ).all():
            found.append(friction)
    assert n == state.rate.size
    return found


class StickSlip:
    """A chain with Coulomb friction: SciPy's steps from event to event, by Pinocchio's matrices."""

    def __init__(self, robot: Robot, x: Array, coulomb: float) -> None:
        self.robot, self.x, self.coulomb, self.events = robot, x.copy(), coulomb, 0
        self._equations, self._senses = RotorEquations(robot), np.zeros(robot.n)

    def fly(self, torque: Array, duration: float) -> None:
        """Hold a torque (n+3,)."""
        time, n = 0.0, self.robot.n
        self._choose(torque)
        while time < duration:
            solved: Any = solve_ivp(
                lambda t, x: self._motion(x, torque)[0],
                (time, duration),
                self.x,
                "DOP853",
                events=[self._margin(joint, torque) for joint in range(n)],
                rtol=1e-11,
                atol=1e-12,
            )
            time, self.x = float(solved.t[-1]), solved.y[:, -1]
            for joint in (k for k, times in enumerate(solved.t_events) if times.size):
                self.events += 1
                if self._senses[joint]:
                    self.x[13 + n + joint] = 0.0
                    self._choose(torque)
                else:
                    self._senses[joint] = np.sign(self._motion(self.x, torque)[1][joint])

    def _motion(self, x: Array, torque: Array) -> tuple[Array, Array]:
        """The derivative of a state, and the friction of all joints."""
        n, attitude = self.robot.n, x[3:7] / np.linalg.norm(x[3:7])
        mass, bias = self._equations.matrices(attitude, x[7 : 7 + n], self._equations.velocity(x))
        turned, acceleration = rotation_of(attitude).apply(torque[:3]), np.zeros(6 + n)
        push = np.concatenate([np.zeros(3), turned, torque[3:]]) - bias
        slides = push - np.concatenate([np.zeros(6), self.coulomb * self._senses])
        free = np.concatenate([np.ones(6, bool), self._senses != 0.0])
        acceleration[free] = np.linalg.solve(mass[np.ix_(free, free)], slides[free])
        return self._equations.rate(x, acceleration), (push - mass @ acceleration)[6:]

    def _choose(self, torque: Array) -> None:
        """Which joints at rest stand, and which break away in which sense."""
        theta, velocity = self.x[7 : 7 + self.robot.n], self._equations.velocity(self.x)
        attitude = self.x[3:7] / np.linalg.norm(self.x[3:7])
        state = State(attitude, theta, *np.split(velocity, [3, 6]))
        friction = solutions(self.robot, state, torque, self.coulomb)[0]
        self._senses = np.where(np.abs(friction) < self.coulomb - 1e-9, 0.0, np.sign(friction))

    def _margin(self, joint: int, torque: Array) -> Any:
        """What falls to zero where a joint comes to rest or breaks away."""
        sense, row = self._senses[joint], 13 + self.robot.n + joint

        def margin(t: float, x: Array) -> float:
            if sense:
                return float(sense * x[row])
            return float(self.coulomb - abs(self._motion(x, torque)[1][joint]))

        margin.terminal, margin.direction = True, -1.0  # type: ignore[attr-defined]
        return margin
