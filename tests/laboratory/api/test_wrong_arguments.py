"""Arguments of the public functions of Python: whatever is passed, one line names it."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import CONFIG

import space_robot as sr
from space_robot import Bench, Campaign, FlownCampaign, FlownFlight, Robot, Scenario
from space_robot.analysis import analyze
from space_robot.api.gymnasium_env import SpaceRobotEnv
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.errors import InputError

UNIT = [1.0, 0.0, 0.0, 0.0]
JUNK: list[Any] = [None, 3, 1.5, True, float("nan"), [], ["x"], {}, {"a": 1}, b"x", object()]
JUNK += [np.zeros(3), np.array([None])]
NO_NUMBERS = [None, "up", [None] * 9, ["a"] * 9, [1j] * 9, [[1.0], [1.0, 2.0]], {}, b"x", object()]
NO_WHOLE_NUMBERS = [1.5, 1.0, "2", True, [1], float("nan"), np.float64(1.0), np.bool_(True)]
SHORT = Scenario(controller=None, duration=0.2)
MASKED = np.ma.array(np.zeros(9), mask=[True] + [False] * 8)


@pytest.fixture(scope="module")
def bench() -> Bench:
    return SHORT.bench()


@pytest.fixture(scope="module")
def flight() -> FlownFlight:
    return Scenario(controller="ctc", duration=0.01).fly()


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
        sr.load_bag,
        sr.replay,
        analyze,
        Campaign,
        Campaign.load,
        Campaign.of,
        FlownCampaign.open,
        lambda junk: sr.mass_matrix(junk, UNIT, np.zeros(6)),
    ],
)
def test_what_is_no_robot_no_bag_and_no_study(call: Callable[[Any], Any]) -> None:
    for junk in JUNK:
        refused(call, junk)


@pytest.mark.parametrize("option", [n for n in Scenario.model_fields if n != "controller"])
def test_what_is_no_option(option: str) -> None:
    """Each field refuses an object that it cannot read; none takes it silently."""
    for junk in (object(), b"x", np.array([None]), 1j):
        refused(Scenario, **{option: junk})


@pytest.mark.parametrize(
    ("options", "said"),
    [
        ({"controler": "ctc"}, "unknown option 'controler' of Scenario: did you mean controller"),
        ({"realtime": True}, "realtime: that needs the graph of nodes: use `fly`"),
        ({"robot": 3.5j}, "robot: a name, a path or a Robot (an object or a mapping) was expected"),
        ({"controller": int}, "Scenario: controller: a name, a path or a ControlLaw (class or"),
        ({"sensors": {"gyros": {}}}, "Scenario: sensors: numbers given: gyros: unknown key"),
        ({"mission": {"joints_deg": [None]}}, "mission: numbers given: joints_deg"),
        ({"gains": [1.0]}, "Scenario: gains: a name, a path or a mapping of gains"),
        ({"gains": {"k_9": 1.0}}, "unknown gain of tde_stc 'k_9'"),
        ({"gains": {"k_1": "much"}}, "tde_stc.k_1: numbers were expected, got ['much']"),
        ({"controller": None}, "controller is None, so there is nothing to fly: use bench()"),
        ({"controller": lambda signals: 0.0}, "9 numbers were expected, got an array of shape ()"),
    ],
)
def test_what_cannot_be_flown_is_told(options: dict[str, Any], said: str) -> None:
    assert said in refused(lambda: Scenario(**options).fly())


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda f: sr.fly_many(5), "scenarios: a list of them was expected"),
        (lambda f: sr.bench_many(Scenario()), "scenarios: a list of them was expected"),
        (lambda f: sr.fly_many([Scenario(), 3]), "scenario 1: a Scenario was expected, got 3"),
        (lambda f: sr.fly_many([Scenario(robot="no_such")]), "scenario 0: "),
        (lambda f: sr.fly_many([SHORT]), "scenario 0: controller is None"),
        (lambda f: sr.fly_many([], progress=7), "progress: a function was expected, "),
        (lambda f: f.metric(5), "a function or file.py:FUNCTION was expected, got 5"),
        (lambda f: f.view(5), "others: flights were expected, got 5"),
        (lambda f: f.plot("control"), "unknown figure 'control'"),
        (lambda f: f.plot(path=""), "is a folder; choose a file name"),
        (lambda f: SHORT.bench().step(MASKED), "torque: numbers were expected"),
        (lambda f: sr.sampled(lambda t: {"base_torque_z": 1j}, 1.0), "a number was expected"),
        pytest.param(
            lambda f: sr.replay(".", law="ctc"),
            "of replay",
            marks=pytest.mark.skipif(find_spec("rclpy") is None, reason="needs rclpy"),
        ),
        (lambda f: SpaceRobotEnv(SHORT, torque_scale=0.0), "torque_scale: 1 or 9 numbers above 0"),
        (lambda f: SpaceRobotEnv(SHORT, torque_scale=[1.0] * 8 + [np.inf]), "torque_scale: 1 or 9"),
        (lambda f: SpaceRobotEnv(SHORT, ticks_per_step=0), "ticks_per_step: 1 or more is allowed"),
    ],
)
def test_what_is_no_scenario_flight_or_number_is_named(
    call: Callable[[FlownFlight], Any], said: str, flight: FlownFlight
) -> None:
    assert said in refused(call, flight)


def test_a_path_stays_as_it_is_written(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A name without a slash is one of those shipped, ``./`` is the folder here."""
    (tmp_path / "robot.yaml").write_bytes((CONFIG / "robots/ets_vii.yaml").read_bytes())
    monkeypatch.chdir(tmp_path)
    assert find_robot("./").name == find_robot("ets_vii").name
    refused(find_robot, ".")


def test_what_is_no_number(bench: Bench, env: SpaceRobotEnv, paper_robot: Robot) -> None:
    zeros, paper = np.zeros(6), paper_robot
    calls: list[Callable[[Any], Any]] = [
        lambda junk: sr.mass_matrix(paper, junk, zeros),
        lambda junk: sr.mass_matrix(paper, UNIT, junk),
        lambda junk: sr.forward_dynamics(paper, UNIT, zeros, junk, zeros, np.zeros(12)),
        paper.from_degrees,
        paper.to_degrees,
        lambda junk: paper.with_last_link(junk, [1.0, 1.0, 1.0, 0.0, 0.0, 0.0]),
        lambda junk: paper.with_last_link(1.0, junk),
        env.step,
        lambda junk: SpaceRobotEnv(SHORT, torque_scale=junk),
    ]
    for junk in NO_NUMBERS:
        for call in calls:
            refused(call, junk)
    for junk in NO_NUMBERS[1:]:  # None: the law's command
        assert refused(bench.step, junk).startswith("torque: numbers were expected, got ")
    assert (bench.tick, env.bench.tick) == (0, 0)
    for step in (env.step, bench.step):
        for count in (8, 10):
            assert "9 numbers were expected" in refused(step, np.zeros(count))


def test_what_is_no_whole_number(bench: Bench) -> None:
    for junk in NO_WHOLE_NUMBERS:
        assert "a whole number was expected" in refused(bench.reset, junk)
        assert "a whole number was" in refused(SpaceRobotEnv, SHORT, ticks_per_step=junk)
    for beyond in (-1, 2**31):
        assert refused(bench.reset, beyond) == f"seed: 0 to 2147483647 is allowed, got {beyond}"
    bench.reset(np.int64(2**31 - 1))  # type: ignore[arg-type]


def test_what_is_no_snapshot_of_the_bench(bench: Bench) -> None:
    for junk in [*JUNK, (1, 2, 3, 4)]:
        refused(bench.restore, junk)
    for others in ({"actuators": "wheels"}, {"controller": "ctc"}, {"robot": "seven_joint"}):
        other = SHORT.replace(**others).bench()
        assert refused(bench.restore, other.save()).startswith("the snapshot is of another ")
        refused(other.restore, bench.save())


def test_what_no_flight_can_be_told(flight: FlownFlight) -> None:
    scenario = Scenario(controller="ctc", duration=0.01)
    for junk in JUNK[1:]:
        assert refused(scenario.fly, bag=junk).startswith("bag: a path was expected")
        if not isinstance(junk, bool):
            told = refused(scenario.fly, progress=junk)
            assert told.startswith("progress: a function was expected")
        assert refused(flight.plot, path=junk).startswith("path: a path was expected")
    for junk in JUNK:
        assert refused(flight.plot, junk).startswith("unknown figure")
    for junk in [*JUNK[1:], "paper", lambda rng: None]:
        assert refused(SpaceRobotEnv, junk).startswith("scenario: ")


@pytest.mark.parametrize("name", ["runs", "seed", "workers", "timeout_s", "out"])
def test_options_of_a_campaign_are_checked_before_it_begins(name: str, tmp_path: Path) -> None:
    options: dict[str, Any] = {"out": tmp_path / "one", name: 2.5j}
    assert refused(Campaign.load("first").run, **options).startswith(f"{name}: ")
    assert not (tmp_path / "one").exists()
