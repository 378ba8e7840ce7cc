"""Arguments of the public functions of Python: whatever is passed, one line names it."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import CONFIG

from space_robot import (
    Bench,
    Campaign,
    FlownCampaign,
    Robot,
    Scenario,
    bench_many,
    fly_many,
    forward_dynamics,
    load_bag,
    mass_matrix,
    replay,
    sampled,
)
from space_robot.analysis import analyze
from space_robot.api.gymnasium_env import SpaceRobotEnv
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

UNIT = [1.0, 0.0, 0.0, 0.0]
JUNK = [
    None,
    3,
    1.5,
    True,
    float("nan"),
    [],
    ["x"],
    {},
    {"a": 1},
    b"x",
    object(),
    np.zeros(3),
    np.array([None]),
]
NO_NUMBERS = [None, "up", [None] * 9, ["a"] * 9, [1j] * 9, [[1.0], [1.0, 2.0]], {}, b"x", object()]
SHORT = Scenario(controller=None, duration=0.2)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return SHORT.bench()


@pytest.fixture(scope="module")
def env() -> SpaceRobotEnv:
    env = SpaceRobotEnv(SHORT)
    env.reset(seed=0)
    return env


def refused(call: Callable[..., Any], *arguments: Any, **options: Any) -> str:
    """Return the one line that a call is refused with."""
    with pytest.raises(InputError) as caught:
        call(*arguments, **options)
    assert "\n" not in str(caught.value)
    return str(caught.value)


@pytest.mark.parametrize(
    "call",
    [
        Robot.from_yaml,
        Robot.from_dict,
        Robot.from_urdf,
        find_robot,
        load_bag,
        replay,
        analyze,
        Campaign,
        Campaign.load,
        Campaign.of,
        FlownCampaign.open,
        lambda junk: mass_matrix(junk, UNIT, np.zeros(6)),
    ],
)
def test_what_is_no_robot_no_bag_and_no_study(call: Callable[[Any], Any]) -> None:
    for junk in JUNK:
        refused(call, junk)


def test_a_path_stays_as_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name without a slash is one of those shipped, ``./`` is the folder here."""
    (tmp_path / "robot.yaml").write_bytes((CONFIG / "robots/ets_vii.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    assert find_robot("./").name == find_robot("ets_vii").name
    refused(find_robot, ".")


def test_what_is_no_number(bench: Bench, env: SpaceRobotEnv) -> None:
    paper = find_robot("paper")
    calls: list[Callable[[Any], Any]] = [
        lambda junk: mass_matrix(paper, junk, np.zeros(6)),
        lambda junk: mass_matrix(paper, UNIT, junk),
        lambda junk: forward_dynamics(paper, UNIT, np.zeros(6), junk, np.zeros(6), np.zeros(12)),
        paper.from_degrees,
        paper.to_degrees,
        lambda junk: paper.with_last_link(junk, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        lambda junk: paper.with_last_link(1.0, junk),
        env.step,
        lambda junk: SpaceRobotEnv(SHORT, torque_scale=junk),
    ]
    for call in calls:
        for junk in NO_NUMBERS:
            refused(call, junk)
    for junk in NO_NUMBERS[1:]:  # None: the law's command
        assert refused(bench.step, junk).startswith("torque: numbers were expected, got ")
    assert (bench.tick, env.bench.tick) == (0, 0)
    for count in (8, 10):
        assert "9 numbers were expected" in refused(env.step, np.zeros(count))
        assert "9 numbers were expected" in refused(bench.step, [0.0] * count)


def test_an_action_may_be_any_nine_numbers(env: SpaceRobotEnv) -> None:
    """As a list, whole or of another length of float: all the same step."""
    seen = []
    for action in ([1, 0, 0, 0, 0, 0, 0, 0, 0], np.eye(9, dtype=np.float32)[0], np.eye(9)[0]):
        env.reset(seed=4)
        seen.append(env.step(action)[1])  # type: ignore[arg-type]
    assert len(set(seen)) == 1


def test_what_is_no_whole_number(bench: Bench) -> None:
    for junk in (1.5, 1.0, "2", True, [1], float("nan"), np.float64(1.0), np.bool_(True)):
        assert "a whole number was expected" in refused(bench.reset, junk)
        assert "a whole number was" in refused(SpaceRobotEnv, SHORT, ticks_per_step=junk)
    assert "a whole number was" in refused(SpaceRobotEnv, SHORT, ticks_per_step=None)
    for beyond in (-1, 2**31):
        assert refused(bench.reset, beyond) == f"seed: 0 to 2147483647 is allowed, got {beyond}"
    bench.reset(np.int64(2**31 - 1))  # type: ignore[arg-type]


def test_what_is_no_snapshot_of_the_bench(bench: Bench) -> None:
    for junk in [*JUNK, (1, 2, 3, 4)]:
        refused(bench.restore, junk)
    for others in (
        {"command_latency_ticks": 2},
        {"actuators": "wheels"},
        {"controller": "ctc"},
        {"robot": "seven_joint"},
    ):
        other = SHORT.replace(**others).bench()
        assert refused(bench.restore, other.save()).startswith("the snapshot is of another ")
        refused(other.restore, bench.save())


def test_what_is_no_scenario_to_learn_in() -> None:
    for junk in [*JUNK[1:], "paper", lambda rng: None]:
        assert refused(SpaceRobotEnv, junk).startswith("scenario: ")


def test_what_no_flight_can_be_told() -> None:
    scenario = Scenario(controller="ctc", duration=0.01)
    for junk in JUNK[1:]:
        assert refused(scenario.fly, bag=junk).startswith("bag: a path was expected")
        if not isinstance(junk, bool):
            told = refused(scenario.fly, progress=junk)
            assert told.startswith("progress: a function was expected")
    flight = scenario.fly()
    for junk in JUNK:
        assert refused(flight.plot, junk).startswith("unknown figure")
        if junk is not None:
            assert refused(flight.plot, path=junk).startswith("path: a path was expected")
    refused(flight.plot, path="")


@pytest.mark.parametrize("option", [n for n in Scenario.model_fields if n != "controller"])
def test_what_is_no_option(option: str) -> None:
    """Each field refuses an object that it cannot read; none takes it silently."""
    for junk in (object(), b"x", np.array([None]), 1j):
        refused(Scenario, **{option: junk})


class NoFloat:
    def __float__(self) -> float:
        raise RuntimeError("no")


def test_what_is_no_scenario_flight_or_number_is_named() -> None:
    flight = Scenario(duration=0.01).fly()
    for several in (5, Scenario()):
        for function in (fly_many, bench_many):
            assert "scenarios: a list of them was expected" in refused(function, several)
        assert "scenarios: a list" in refused(fly_many, several, progress=True)
    assert refused(flight.metric, 5) == "a function or file.py:FUNCTION was expected, got 5"
    masked = np.ma.array(np.zeros(9), mask=[True] + [False] * 8)
    assert refused(SHORT.bench().step, masked).startswith("torque: numbers were expected")
    assert refused(flight.view, 5) == "others: flights were expected, got 5"
    assert "failed: RuntimeError: no" in refused(flight.metric, lambda log: NoFloat())
    for value in (np.zeros(6) + 1j, {"base_torque_z": 1j}):
        assert "a number was expected" in refused(sampled, lambda time, value=value: value, 1.0)


@pytest.mark.parametrize("name", ["runs", "seed", "workers", "timeout_s", "out"])
def test_options_of_a_campaign_are_checked_before_it_begins(name: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {"out": tmp_path / "one", name: 2.5j}
    assert refused(Campaign.load("first").run, **options).startswith(f"{name}: ")
    assert not (tmp_path / "one").exists()
