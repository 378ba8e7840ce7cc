"""Nodes that die, hang or meet a half turn: what the rest of the graph does about it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import space_robot_here

from space_robot.flight.replay.outcome import ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")

PERIOD = 0.0005


class Story:
    """A flight's events and bag."""

    def __init__(self, bag: Path, *options: str) -> None:
        self.result = space_robot_here("fly", "--bag", str(bag), "--json", *options)
        assert self.result.stdout, self.result.stderr
        assert "Traceback" not in self.result.stderr
        self.report: dict[str, Any] = json.loads(self.result.stdout)
        self.bag, self.log = bag, read_flight(bag)

    def time_of(self, node: str, what: str, after: float = 0.0) -> float:
        """Simulated time of the first event of a node that begins so."""
        for event in self.report["graph"]["events"]:
            if (
                event["node"] == f"{node}_node"
                and event["what"].startswith(what)
                and event["simulated_s"] >= after
            ):
                return float(event["simulated_s"])
        raise AssertionError(f"{node}: {what!r} not in {self.report['graph']['events']}")

    def error(self, at_s: float) -> float:
        """Largest joint error at a time, rad."""
        k = round(at_s / PERIOD)
        return float(np.abs(self.log.reference_joints[k, 0] - self.log.joint_positions[k]).max())


@pytest.fixture(scope="module")
def deaths(tmp_path_factory: pytest.TempPathFactory) -> Story:
    """Controller, mission and recorder killed one after the other; the controller comes back."""
    return Story(
        tmp_path_factory.mktemp("deaths") / "bag",
        "--duration",
        "11",
        "--restart-controller",
        "--set",
        "plant.silence_timeout=0.2",
        "--set",
        "controller.reference_timeout=0.2",
        "--fault",
        "kill_controller@0.3",
        "--fault",
        "kill_mission@9",
        "--fault",
        "kill_recorder@10.5",
    )


def without_torque(story: Story) -> tuple[int, int]:
    """The ticks after the controller's death in which no torque acted: first, and one past last."""
    killed = round(story.time_of("controller", "killed") / PERIOD)
    acts = np.abs(story.log.applied_torque[killed:]).max(axis=1) > 0.0
    first = int(np.argmin(acts))
    assert not acts[first]
    return killed + first, killed + first + int(np.argmax(acts[first:]))


def test_dead_controller_leaves_the_plant_holding_then_without_torque(deaths: Story) -> None:
    killed = round(deaths.time_of("controller", "killed") / PERIOD)
    deaths.time_of("plant", "safe: no good command, the torque is zero")
    safe, back = without_torque(deaths)
    held = deaths.log.applied_torque[safe - 50 : safe]
    assert killed < safe < back
    np.testing.assert_array_equal(held, np.broadcast_to(held[0], held.shape))


def test_restarted_controller_takes_over_without_a_jolt(deaths: Story) -> None:
    """From the echoed force, which is none: its first step is like those of its next 10 ms.

    The force before the death would be a step of hundreds of times that.
    """
    assert deaths.report["graph"]["restarts"] == 1
    _, back = without_torque(deaths)
    steps = np.abs(np.diff(deaths.log.applied_torque[back - 1 : back + 20], axis=0))
    assert np.all(steps[0] <= 3.0 * steps[1:].max(axis=0))


def test_restarted_controller_flies_the_mission_on(deaths: Story) -> None:
    back = deaths.time_of("plant", "nominal", after=0.3)
    assert back < 5.5
    assert deaths.error(back + 3.4) < 0.5 * max(deaths.error(back), 1e-3)


def test_the_restart_is_recorded_and_replayed(deaths: Story, domain: int) -> None:
    """The replayed controller, too, begins again: to the last bit like the one that did."""
    first, again = deaths.log.laws
    assert (first.tick, first.is_first, again.is_first) == (0, True, True)
    assert again.tick > 0.3 / PERIOD
    assert deaths.log.commanded_torque is not None
    answered = np.flatnonzero(np.isfinite(deaths.log.commanded_torque).all(axis=1))
    assert again.tick in answered, "the recorder has missed what the controller answered first"
    last = int(answered[answered > again.tick][200])
    done = replay(ReplayOptions(deaths.bag, domain=domain, end_s=(last + 1) * PERIOD))
    assert done.comparison.is_identical, done.report()["first_difference"]
    assert done.comparison.ticks[-1] == last


def test_without_mission_the_last_point_is_held(deaths: Story) -> None:
    deaths.time_of("controller", "holding the reference: the mission is silent", after=9.0)
    assert int(deaths.report["graph"]["nodes"]["controller_node"]["references_held"]) > 100


def test_without_recorder_the_flight_goes_on_and_the_exit_code_tells(deaths: Story) -> None:
    assert deaths.result.returncode == 1
    assert "recorder ended by signal 9" in deaths.result.stderr
    assert deaths.report["unfinished"]
    assert int(deaths.report["graph"]["nodes"]["plant_node"]["tick"]) == 22_000


@pytest.fixture(scope="module")
def hangs(tmp_path_factory: pytest.TempPathFactory) -> Story:
    """Recorder, controller and mission stopped for a while one after the other."""
    return Story(
        tmp_path_factory.mktemp("hangs") / "bag",
        "--duration",
        "9",
        "--set",
        "plant.silence_timeout=0.5",
        "--set",
        "controller.reference_timeout=1",
        "--set",
        "mission.lead_ticks=200",
        "--fault",
        "stop_recorder@0.2:1",
        "--fault",
        "stop_controller@1.5:2.5",
        "--fault",
        "stop_mission@5:1.8",
    )


def test_stopped_recorder_loses_nothing(hangs: Story) -> None:
    assert hangs.result.returncode == 0, hangs.result.stderr
    assert not any(hangs.report["lost"].values())
    assert hangs.report["ticks"] == 18_000
    assert hangs.report["filled_ticks"] == 0


def test_stopped_controller_comes_back_by_itself(hangs: Story) -> None:
    safe = hangs.time_of("plant", "safe: no good command", after=1.5)
    assert hangs.time_of("plant", "nominal", after=safe) > safe
    assert hangs.report["graph"]["restarts"] == 0


def test_stopped_mission_is_waited_for_then_followed_again(hangs: Story) -> None:
    held = hangs.time_of("controller", "holding the reference", after=5.0)
    assert hangs.time_of("controller", "nominal", after=held) >= held


def test_half_a_turn_is_safe_mode_with_its_reason_and_no_nan(tmp_path: Path) -> None:
    story = Story(
        tmp_path / "bag",
        "--duration",
        "0.5",
        "--composed",
        "--set",
        "plant.initial_quaternion=[0.01, 0.9, 0.3, 0.3]",
    )
    assert story.result.returncode == 0
    story.time_of("controller", "safe: attitude error near 180 degrees")
    np.testing.assert_array_equal(story.log.applied_torque, 0.0)
    assert np.isfinite(story.log.quaternion).all()


def test_a_lost_controller_that_nobody_restarts_leaves_a_safe_plant(tmp_path: Path) -> None:
    story = Story(
        tmp_path / "bag",
        "--duration",
        "3",
        "--set",
        "plant.silence_timeout=0.3",
        "--fault",
        "kill_controller@0.3",
    )
    assert story.result.returncode == 0
    assert story.report["ticks"] == 6000
    np.testing.assert_array_equal(story.log.applied_torque[-500:], 0.0)
