"""Gymnasium environment of a bench, for learning to follow a mission by torques.

from space_robot.api.gymnasium_env import SpaceRobotEnv
env = SpaceRobotEnv(Scenario(controller=None, sensors="fine"))
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from space_robot_model.dynamics.attitude import attitude_error_into, rotate_back, rotation_matrix
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.config.arguments import as_numbers, as_whole_number
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotState

from .scenario import FlyableScenario as Scenario

try:
    import gymnasium
    from gymnasium.spaces import Box
except ImportError:
    raise ImportError(f"gymnasium is not installed: {install_command('gym')}") from None


ScenarioDraw = Callable[[np.random.Generator], Scenario]

WORST_COST = 100.0
"""Cost per second that terminates an episode: that of a joint error of 10 rad."""
RATE_WEIGHT, ACTION_WEIGHT = 0.1, 1e-3
"""Weights of squared rates, rad2/s2, and squared actions in the cost per second; the weight of
squared errors, rad2, is 1."""
LARGEST = 1e4
"""Limit of the absolute values of an observation; larger ones are clipped."""
NAME = "space_robot/Tracking-v0"
"""Name for `gymnasium.make`, registered when this module is imported."""


class SpaceRobotEnv(gymnasium.Env[Array, Array]):
    """Environment of a scenario's mission on m = n+3 axes: base x, y, z, then n actuated joints.

    - Observation (2 m + n,), as measured by the sensors: the error ``rho_d - rho`` (m,), for the
      base the vector part of the rotation from the actual to the desired attitude, for joints rad
      (or m); its rate (m,), for the base the angular velocity in the base frame, rad/s; the joint
      positions (n,).
    - Action (m,) from -1 to 1: the torque divided by ``torque_scale``, held over
      ``ticks_per_step`` ticks. On the base's axes it is limited by the actuators.
    - Reward: -cost dt for every step of dt s, from the true state, with the cost per second
      ``4 |e_eps|^2 + |e_theta|^2 + 0.1 |edot|^2 + 0.001 |action|^2``.
    - Terminated: the cost is `WORST_COST` or more, or the flight has diverged. The rest of the
      mission then costs `WORST_COST` per second, so that an early end is never an advantage.
    - Truncated: the mission, or the scenario's ``duration``, is over.

    `reset` draws a seed of sensors and faults for each episode. ``bench`` is the underlying
    `Bench`; its snapshots may be restored between two steps.
    """

    def __init__(
        self,
        scenario: Scenario | ScenarioDraw | None = None,
        ticks_per_step: int = 20,
        torque_scale: ArrayLike = 10.0,
    ) -> None:
        """Create the bench of a scenario.

        Args:
            scenario: None: the paper's. A function that draws a scenario from a random generator
                is called at every reset; the number of joints must be constant.
            ticks_per_step: 20 ticks of 0.5 ms give 100 steps/s.
            torque_scale: torque, N m (prismatic joints: N), of an action of 1; scalar or (m,).
        """
        if scenario is None:
            scenario = Scenario(controller=None)
        self._draw = None if isinstance(scenario, Scenario) else scenario
        first = scenario if isinstance(scenario, Scenario) else _drawn(scenario, 0)
        self._ticks = as_whole_number(ticks_per_step, "ticks_per_step", 1)
        scale = as_numbers(torque_scale, "torque_scale")
        self.bench = first.bench(record=False)
        m = self.bench.axes
        if scale.shape not in ((), (m,)) or not np.all((scale > 0.0) & np.isfinite(scale)):
            raise InputError(f"torque_scale: 1 or {m} numbers above 0 are allowed, got {scale}")
        self._scale = scale
        self._high = np.full(3 * m - 3, LARGEST)
        self._high[:3] = 2.0
        self.observation_space = Box(-self._high, self._high, dtype=np.float64)
        self.action_space = Box(-1.0, 1.0, (m,), np.float64)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, dict[str, Any]]:
        """Start an episode; ``options`` is not used."""
        super().reset(seed=seed)
        if self._draw is not None:
            bench = _drawn(self._draw, self.np_random).bench(record=False)
            if bench.axes != self.bench.axes:
                raise InputError(
                    f"scenario: {self.bench.axes} axes were expected, got {bench.axes}"
                )
            self.bench = bench
        state = self.bench.reset(int(self.np_random.integers(2**31)))
        return self._observation(state), self._info()

    def step(self, action: Array) -> tuple[Array, float, bool, bool, dict[str, Any]]:
        """Apply an action for ``ticks_per_step`` ticks, fewer at the end of the mission."""
        bench, action = self.bench, as_numbers(action, "action")
        if action.shape != self.action_space.shape:
            raise InputError(
                f"action: {bench.axes} numbers were expected, got an array of shape {action.shape}"
            )
        first, torque = bench.tick, self._scale * action
        for _ in range(self._ticks):
            bench.step(torque)
            if bench.done:
                break
        cost = self._cost(action)
        has_failed = bench.outcome not in ("", "complete") or not cost < WORST_COST
        charged = bench.ticks if has_failed else bench.tick
        reward = -(WORST_COST if has_failed else cost) * (charged - first) * bench.period
        truncated = bench.done and not has_failed
        return self._observation(bench.state), reward, has_failed, truncated, self._info()

    def _observation(self, state: RobotState) -> Array:
        error, rate = self._errors(state)
        observation = np.concatenate((error, rate, state.joint_positions))
        cut: Array = np.clip(np.nan_to_num(observation), -self._high, self._high)
        return cut

    def _errors(self, state: RobotState) -> tuple[Array, Array]:
        reference = self.bench.reference
        turn, rotation, omega = np.zeros(4), np.empty((3, 3)), np.empty(3)
        attitude_error_into(reference.quaternion, state.quaternion, turn)
        rotation_matrix(turn, rotation)
        rotate_back(rotation, reference.omega_base, omega)
        return (
            np.concatenate((-turn[1:], reference.joint_positions - state.joint_positions)),
            np.concatenate(
                (omega - state.omega_base, reference.joint_velocities - state.joint_velocities)
            ),
        )

    def _cost(self, action: Array) -> float:
        error, rate = self._errors(self.bench.truth)
        return float(
            4.0 * error[:3] @ error[:3]
            + error[3:] @ error[3:]
            + RATE_WEIGHT * rate @ rate
            + ACTION_WEIGHT * action @ action
        )

    def _info(self) -> dict[str, Any]:
        bench = self.bench
        return {"time_s": bench.time, "outcome": bench.outcome, "reason": bench.reason}


def _drawn(draw: ScenarioDraw, rng: np.random.Generator | int) -> Scenario:
    expected = "scenario: a Scenario, or a function of a random generator that returns one, was"
    if not callable(draw):
        raise InputError(f"{expected} expected, got {short(draw)}")
    scenario = draw(np.random.default_rng(rng))
    if not isinstance(scenario, Scenario):
        raise InputError(f"{expected} expected, got a function that returned {short(scenario)}")
    return scenario


if NAME not in gymnasium.registry:
    gymnasium.register(NAME, f"{__name__}:{SpaceRobotEnv.__name__}")
