"""The task reach: one environment, and many in lanes with the same bits."""

from __future__ import annotations

import os
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from robots import driven_paper

import space_robot as sr
from space_robot_msgs_py.errors import InputError

gymnasium = pytest.importorskip("gymnasium")
from gymnasium.utils.env_checker import check_env  # noqa: E402
from gymnasium.vector import AutoresetMode, SyncVectorEnv  # noqa: E402

from space_robot.learning.reach_env import NAME, ReachEnv, ReachVectorEnv  # noqa: E402

DRIVEN = sr.Robot.from_dict(driven_paper())
RESET = ReachVectorEnv(3)
SHORT: dict[str, Any] = {"duration": 0.03, "ticks_per_step": 2}


@pytest.mark.filterwarnings("ignore:.*WARN")
def test_it_is_an_environment_of_gymnasium() -> None:
    check_env(gymnasium.make(NAME, **SHORT).unwrapped)


@pytest.mark.parametrize(("robot", "threads"), [("dual_arm", 2), ("flexible_panels", 1)])
def test_many_have_the_bits_of_single_ones(robot: str, threads: int) -> None:
    """Over resets, failures (large actions diverge) and ends of episodes, in eleven lanes."""
    count = 11
    settings = {**SHORT, "scenario": sr.Scenario(robot=robot, case="3")}
    envs = sr.make_vec("reach", num_envs=count, threads=threads, **settings)
    singles = SyncVectorEnv(
        [lambda: sr.make("reach", **settings) for _ in range(count)],
        autoreset_mode=AutoresetMode.NEXT_STEP,
    )
    np.testing.assert_array_equal(envs.reset(seed=5)[0], singles.reset(seed=5)[0])
    generator, failed, ended = np.random.default_rng(1), 0, 0
    for step in range(80):
        actions = generator.uniform(-1.0, 1.0, envs.action_space.shape)
        if step > 50:
            actions[::3] *= 1e4
        for one, other in zip(envs.step(actions)[:4], singles.step(actions)[:4], strict=True):
            assert one.dtype == other.dtype
            np.testing.assert_array_equal(one, other)
        failed += int(np.sum(singles._terminations))
        ended += int(np.sum(singles._truncations))
    assert failed > 3
    assert ended > 10
    envs.close()
    singles.close()


def test_threads_of_a_forked_process_are_its_own() -> None:
    envs = sr.make_vec("reach", num_envs=16, threads=2, **SHORT)
    envs.reset(seed=1)
    actions = np.zeros(envs.action_space.shape)
    envs.step(actions)
    child = os.fork()
    if not child:  # pragma: no cover
        envs.step(actions)
        os._exit(5)
    _, status = os.waitpid(child, 0)
    assert os.waitstatus_to_exitcode(status) == 5
    envs.close()


def test_an_episode_is_a_second_of_steps_with_rewards_below_zero() -> None:
    env = sr.make("reach", duration=0.02, ticks_per_step=4)
    first, _ = env.reset(seed=3)
    again, _ = env.reset(seed=3)
    np.testing.assert_array_equal(first, again)
    assert env.observation_space.contains(first)
    rewards = []
    for step in range(10):
        _, reward, failed, truncated, _ = env.step(np.zeros(9))
        rewards.append(reward)
        assert not failed
        assert truncated == (step == 9)
    assert max(rewards) < 0.0
    with pytest.raises(InputError, match="the episode is over"):
        env.step(np.zeros(9))


@pytest.mark.parametrize(("task", "counted"), [("reach", [0, 1, 2]), ("point", [0, 1])])
def test_the_reward_counts_the_attitude_or_the_boresight_alone(
    task: str, counted: list[int]
) -> None:
    env, seconds = sr.make(task, duration=1.0, ticks_per_step=400), 0.2
    env.reset(seed=1)
    env.step(np.array([50.0] * 3 + [0.0] * 6))
    observation, reward = env.step(np.zeros(9))[:2]
    assert abs(observation[2]) > 1e-3
    attitude, joints, rates = observation[counted], observation[3:9], observation[9:]
    cost = 4.0 * attitude @ attitude + joints @ joints + 0.1 * rates @ rates
    assert reward == pytest.approx(-cost * seconds, rel=1e-12)


def test_a_failure_costs_the_rest_of_the_episode() -> None:
    env, total, failed, truncated = ReachEnv(duration=1.0, torque_scale=1e6), 0.0, False, False
    env.reset(seed=0)
    while not (failed or truncated):
        _, reward, failed, truncated, _ = env.step(np.ones(9))
        total += reward
    assert failed
    assert total == pytest.approx(-100.0, rel=0.05)


@pytest.mark.parametrize(
    ("settings", "said"),
    [
        ({"scenario": sr.Scenario(sensors="fine")}, "scenario: sensors, drives or faults"),
        ({"scenario": sr.Scenario(actuators="wheels")}, "scenario: a base without ideal torques"),
        ({"scenario": sr.Scenario(command_latency_ticks=2)}, "scenario: delayed commands"),
        ({"scenario": sr.Scenario(orbit="iss")}, "scenario: an orbit: the task reach has none"),
        ({"scenario": sr.Scenario(robot=DRIVEN)}, "scenario: joints with gears"),
        ({"scenario": 3}, "scenario: a Scenario was expected"),
        ({"duration": 0.0}, "duration: a number above 0 was expected"),
        ({"reach": -1.0}, "reach: a number 0 or more was expected"),
        ({"boresight": [0.0, 0.0, 0.0]}, "boresight: three numbers, not all 0"),
        ({"ticks_per_step": 0}, "ticks_per_step"),
        ({"torque_scale": [1.0, 2.0]}, "torque_scale: 1 or 9 numbers above 0"),
        ({"foo": 1}, "unknown setting 'foo' of the task reach: choose one of"),
    ],
)
def test_wrong_settings_are_named(settings: dict[str, Any], said: str) -> None:
    for make in (sr.make, sr.make_vec):
        with pytest.raises(InputError, match=said):
            make("reach", **settings)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda: sr.make("fetch"), "fetch"),
        (lambda: sr.make_vec("reach", num_envs=1e9), "num_envs: a whole number was expected"),
        (lambda: sr.make_vec("reach", num_envs=10**9), "num_envs: 1 to 262144 is allowed"),
        (lambda: sr.make_vec("reach", threads=10**6), "threads: 1 to 1024 is allowed"),
        (lambda: sr.make_vec("reach", 4).reset(seed=[1, 2]), "seed: 4 numbers were expected"),
        (lambda: sr.make_vec("reach", 2).reset(seed=[1, "x"]), r"seed\[1\]: a whole number was"),
        (lambda: sr.make_vec("reach", 2).reset(seed=-1), "seed: 0 or more is allowed, got -1"),
        (lambda: ReachVectorEnv(3).step(np.zeros((3, 9))), "reset the environments"),
        (lambda: RESET.step(np.zeros((2, 9))), r"action: an array of shape \(3, 9\)"),
    ],
)
def test_wrong_arguments_are_named(call: Callable[[], Any], said: str) -> None:
    RESET.reset()
    with pytest.raises(InputError, match=said):
        call()
