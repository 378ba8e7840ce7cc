"""The environment for learning: Gymnasium's own checks, and what the manual says of it."""

from __future__ import annotations

from typing import Any

import gymnasium
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env
from gymnasium.wrappers import PassiveEnvChecker

from space_robot import Scenario
from space_robot.api.gymnasium_env import NAME, WORST_COST, SpaceRobotEnv
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.errors import InputError

SCENARIO = Scenario(controller=None, sensors="fine", duration=0.2)


def fly(env: Any, seed: int, action: Array) -> list[tuple[Any, ...]]:
    observation, info = env.reset(seed=seed)
    found: list[tuple[Any, ...]] = [(observation, 0.0, False, False, info)]
    while not (found[-1][2] or found[-1][3]):
        found.append(env.step(action))
    return found


@pytest.mark.filterwarnings("error", "ignore:.*not having a spec")
@pytest.mark.parametrize("scenario", [SCENARIO, SCENARIO.replace(actuators="wheels")])
def test_gymnasiums_checker_finds_nothing(scenario: Scenario) -> None:
    check_env(SpaceRobotEnv(scenario))


@pytest.mark.filterwarnings("error")
def test_it_is_made_by_name_and_checked_at_every_step() -> None:
    made: Any = gymnasium.make(NAME, scenario=SCENARIO)
    assert isinstance(made.env, PassiveEnvChecker)
    *_, last = fly(made, 1, np.zeros(9))
    assert last[2:4] == (False, True)
    assert last[4] == {"time_s": 0.2, "outcome": "complete", "reason": ""}
    with pytest.raises(InputError, match="the flight is over"):
        made.unwrapped.step(np.zeros(9))


def test_observation_and_reward_are_as_documented() -> None:
    """The action may be a list, or of another length of float."""
    env, floats = SpaceRobotEnv(SCENARIO), np.linspace(-0.1, 0.1, 9).astype(np.float32)
    action = floats.astype(float)
    rewards = []
    for numbers in (action.tolist(), floats, action):
        env.reset(seed=4)
        seen, reward, *_ = env.step(numbers)
        rewards.append(reward)
    assert len({*rewards}) == 1
    bench = env.bench
    truth, measured, reference = bench.truth, bench.state, bench.reference
    assert bench.tick == 20
    np.testing.assert_array_equal(seen[:3], reference.quaternion[1:] - measured.quaternion[1:])
    np.testing.assert_array_equal(seen[3:9], reference.joint_positions - measured.joint_positions)
    np.testing.assert_array_equal(seen[9:12], -measured.omega_base)
    np.testing.assert_array_equal(seen[18:], measured.joint_positions)
    eps = truth.quaternion[1:] - reference.quaternion[1:]
    theta = truth.joint_positions - reference.joint_positions
    omega = truth.omega_base - reference.omega_base
    rate = truth.joint_velocities - reference.joint_velocities
    cost = (
        4.0 * np.sum(eps**2)
        + np.sum(theta**2)
        + 0.1 * (np.sum(omega**2) + np.sum(rate**2))
        + 0.001 * np.sum(action**2)
    )
    np.testing.assert_allclose(reward, -cost * 0.01, rtol=1e-12)


def test_a_quaternion_and_its_negative_are_one_attitude() -> None:
    """Of the mission and of the robot: the errors are those of the nearer one."""
    half = float(np.sqrt(0.5))
    episodes = []
    for wanted, placed in ((1.0, 1.0), (-1.0, 1.0), (1.0, -1.0)):
        turned = [half, 0.0, half, 0.0]
        away = [half * np.cos(0.05), half * np.sin(0.05), half * np.cos(0.05), 0.0]
        parameters = {
            "mission": {"base_quaternion": [wanted * q for q in turned]},
            "plant": {"initial_quaternion": [placed * q for q in away]},
        }
        env = SpaceRobotEnv(Scenario(controller=None, duration=0.1, parameters=parameters))
        episodes.append(fly(env, 1, np.full(9, 0.1)))
    for episode in episodes[1:]:
        for one, other in zip(episodes[0], episode, strict=True):
            np.testing.assert_allclose(np.abs(other[0]), np.abs(one[0]), rtol=1e-9, atol=1e-12)
            np.testing.assert_allclose(other[1], one[1], rtol=1e-9)
    assert 0.01 < np.linalg.norm(episodes[0][0][0][:3]) < 0.1


@pytest.mark.parametrize("scale", [1e3, 1e9])
def test_an_early_end_costs_all_that_is_left(scale: float) -> None:
    """Lost or diverged: at no time is it better than the dearest episode that goes on."""
    env = SpaceRobotEnv(SCENARIO, torque_scale=scale)
    *before, last = fly(env, 0, np.ones(9))
    assert last[2:4] == (True, False)
    left = 0.2 - sum(0.01 for _ in before[1:])
    assert last[1] == pytest.approx(-WORST_COST * left)
    assert env.observation_space.contains(last[0])
    assert last[4]["outcome"] == ("diverged" if scale > 1e6 else "")


def test_a_scenario_may_be_drawn_at_every_reset() -> None:
    def draw(rng: np.random.Generator) -> Scenario:
        return SCENARIO.replace(case=str(rng.choice(["1", "2", "3"])), duration=0.1)

    env = SpaceRobotEnv(draw)
    cases = set()
    for seed in range(6):
        env.reset(seed=seed)
        cases.add(env.bench.flight.scenario.options.case)
    assert len(cases) > 1
    changing = SpaceRobotEnv(lambda rng: SCENARIO)
    changing._draw = lambda rng: Scenario(controller=None, robot="seven_joint")
    with pytest.raises(InputError, match="9 axes were expected, got 10"):
        changing.reset()
