"""Saturation, latency, commands that were not applied, and what is said of them at the end."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from benches import WHEEL_AXES as PYRAMID
from benches import flat, hardware, still_log
from hypothesis import given, settings
from hypothesis import strategies as st
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import analyze, measure
from space_robot.analysis.actuation import standing
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.report_tables import sizing_table
from space_robot.analysis.words import remarks, warnings, with_statistic
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

LIMITED = hardware(
    wheels={
        "axes": flat(np.eye(3)),
        "rotor_inertia": [0.1],
        "max_torque": [0.5],
        "max_momentum": [2.0, 0.0, 2.0],
    }
)
FREE, IDEAL = BaseActuatorSettings(base_actuation="none"), BaseActuatorSettings()


def flown(**options: Any) -> FlightLog:
    return Scenario(**{"duration": 0.2, **options}).fly().log


def described(log: FlightLog, latency_ticks: int, base: float, joint: float) -> FlightLog:
    """The same flight as a bag tells it, with these limits of its torques."""
    plant = {"base_torque_limit": base, "joint_torque_limit": joint}
    flight = {"command_latency_ticks": latency_ticks, "scenario": {"parameters": {"plant": plant}}}
    return replace(log, scenario=None, flight=flight)


@pytest.mark.parametrize("commands", [None, np.full((20, 9), np.nan)])
def test_without_commands_nothing_is_known(commands: np.ndarray | None) -> None:
    log = flown(duration=0.01)
    log.commanded_torque = commands
    report = analyze(log)
    assert report["unavailable"]["commands"] == "the commands were not recorded"
    assert "not flown as a graph" in report["unavailable"]["latency"]
    assert not [name for name in report["metrics"] if name.startswith(("commands", "torque_li"))]


@settings(max_examples=40)
@given(st.sampled_from([1, 3, 6, 7]), st.integers(0, 99), st.integers(0, 4))
def test_missed_deadlines_and_saturation_are_those_of_plain_loops(
    n: int, seed: int, latency_ticks: int
) -> None:
    """Filled ticks repeat the state before; what stands there was not measured."""
    log = random_log(n, 60, seed, latency_ticks)
    rng = np.random.default_rng(seed)
    log.applied_torque[rng.random(60) < 0.1, rng.integers(n + 3)] = -2.0
    if seed % 2:
        log.filled = 8
        for k in rng.integers(1, 60, 8):
            for name in ("quaternion", "omega_base", "joint_positions", "joint_velocities"):
                getattr(log, name)[k] = getattr(log, name)[k - 1]
    assert log.commanded_torque is not None
    limit = [2.0] * 3 + [1.5] * n
    differ = compared = saturated = 0
    for k in range(60):
        applied = log.applied_torque[k].tolist()
        saturated += any(abs(x) >= y for x, y in zip(applied, limit, strict=True))
        if k - latency_ticks - 1 < 0:
            continue
        commanded = log.commanded_torque[k - latency_ticks - 1].tolist()
        names = ("quaternion", "omega_base", "joint_positions")
        repeats = all((getattr(log, x)[k] == getattr(log, x)[k - 1]).all() for x in names)
        if any(map(math.isnan, commanded)) or (log.filled and repeats):
            continue
        compared += 1
        clipped = [max(-y, min(y, x)) for x, y in zip(commanded, limit, strict=True)]
        differ += clipped != applied
    expected = {
        "torque_limits.base": 2.0,
        "torque_limits.joints": 1.5,
        "torque_limits.ticks": saturated,
        "torque_limits.share": saturated / 60,
    }
    if np.isfinite(log.commanded_torque[:, 0]).any():
        expected |= {"commands.differing": differ, "commands.compared": compared}
    assert measure(described(log, latency_ticks, 2.0, 1.5), list(expected)) == expected


def test_percentiles_of_the_latency() -> None:
    log = random_log(1, 102, 0)
    log.latency_s = np.append(np.arange(101.0, 0.0, -1.0) * 1e-5, np.nan)
    expected = {
        "latency.answers": 101,
        "latency.p50_ms": 0.51,
        "latency.p99_ms": 1.0,
        "latency.max_ms": 1.01,
        "latency.p50_ticks": 1.02,
        "latency.p99_ticks": 2.0,
        "latency.max_ticks": 2.02,
    }
    assert measure(log, list(expected)) == pytest.approx(expected)
    log.latency_s[:] = np.nan
    assert "not flown as a graph" in analyze(log)["unavailable"]["latency"]


def test_joints_stand_where_they_were_to_move() -> None:
    """By the way: the slow start of a motion counts for little, a joint that holds not at all."""
    log = FlightLog.allocate(400, ("a", "b", "c"), Timebase(500_000_000))
    ramp = np.linspace(0.0, 1.0, 400)
    log.reference_joints[:, 1, 0], log.reference_joints[:, 1, 1] = ramp, -ramp
    log.joint_velocities[:], log.reference_joints[:, :, 2] = 0.0, 0.0
    log.joint_velocities[:, 0] = ramp
    log.joint_velocities[100:, 1] = -0.5 * ramp[100:]
    found = standing.evaluate(AnalysedLog(log), range(400))
    assert found == {"a.standing": 0.0, "b.standing": pytest.approx(0.0625, abs=1e-3)}


def test_wheels_that_reverse_and_efforts_near_a_limit_are_warnings() -> None:
    log = flown(actuators="wheels", sensors="fine", duration=1.0)
    report, speeds = analyze(log), log.wheel_velocities
    metrics = report["metrics"]
    changes = [len(np.flatnonzero(np.diff(wheel[wheel != 0.0] > 0.0))) for wheel in speeds.T]
    assert [metrics[f"wheel_{k}.reversals"] for k in range(1, 5)] == changes
    assert report["warnings"] == analyze(log, in_brief=True)["warnings"] == warnings(metrics)
    said = warnings({"wheel_1.reversals": 1.0, "wheel_2.reversals": 0.9, "a.effort_used": 0.95})
    assert said == [
        "wheels that change their sense of rotation: wheel_1 1 times a second",
        "joints near their limit of effort: a 95%",
    ]


def test_joints_that_stood_are_said_from_a_share_of_their_way_on() -> None:
    """Friction of 2 N m and a law that is weak on three joints."""
    weak = {f"pd.{name}": [1e4] * 6 + [5.0] * 3 for name in ("k_p", "k_d")}
    own = {"plant": {"friction.coulomb": 2.0}, "controller": weak}
    report = analyze(flown(controller="pd", duration=4.0, parameters=own))
    metrics = report["metrics"]
    assert metrics["joint4.standing"] > 0.3
    for joint in range(1, 7):
        del metrics[f"joint{joint}.standing"]
    metrics |= {"a.standing": 0.051, "b.standing": 0.05, "c.standing": 0.049}
    (said,) = [x for x in warnings(metrics) if "stood still" in x]
    assert said.endswith("way they were to move: a 5%, b 5%")
    metrics |= {"a.standing": 0.0, "b.standing": 0.0}
    assert not [x for x in warnings(metrics) if "stood still" in x]


def test_saturation_and_missed_deadlines_are_the_plants() -> None:
    """Also with commands on their way; another delay or none of its limits would be told."""
    parameters = {"plant": {"base_torque_limit": 0.05, "joint_torque_limit": 0.02}}
    options = {"parameters": parameters, "command_latency_ticks": 1}
    flight = Scenario(duration=0.2, **options).fly()
    log, metrics = flight.log, flight.metrics
    counted = metrics["torque_limits.ticks"]
    # the plant's own count has no torque at tick 0, but one more at the end
    assert 0 < counted <= flight.flight.plant.saturated_ticks <= counted + 1
    for latency_ticks, base, joint in ((1, 2.0, 1.5), (2, 0.05, 0.02)):
        assert measure(described(log, latency_ticks, base, joint))["commands.differing"] > 0
    counts = [metrics[f"commands.{name}"] for name in ("unanswered", "compared", "differing")]
    assert counts == [0, 398, 0]
    limits = [metrics[f"torque_limits.{part}"] for part in ("base", "joints")]
    assert limits == [0.05, 0.02]


def test_wheels_at_their_limits_are_counted_and_said(paper_robot: Robot) -> None:
    log = still_log(paper_robot, 100, LIMITED)
    log.wheel_torques[10:20, 0] = -0.5
    log.wheel_velocities[15:40, 0] = -20.0
    log.wheel_velocities[:, 1] = 1e3  # without a limit
    log.wheel_torques[50, 2], log.wheel_velocities[49, 2] = 0.25, (2.0 - 0.25 * 0.0005) / 0.1
    log.flight["scenario"] = {"parameters": {"plant": {"joint_torque_limit": 3.0}}}
    report = analyze(log)
    counted = report["metrics"].items()
    found = {name: x for name, x in counted if name.startswith("wheel") and "reve" not in name}
    assert found == {
        "wheels.saturation": 0.32,
        "wheels.saturation_ticks": 10 + 21 + 1,
        "wheel_1.torque_limit_ticks": 10,
        "wheel_1.momentum_limit_ticks": 25,
        "wheel_1.first_limit": 0.005,
        "wheel_2.torque_limit_ticks": 0,
        "wheel_2.momentum_limit_ticks": 0,
        "wheel_3.torque_limit_ticks": 0,
        "wheel_3.momentum_limit_ticks": 1,
        "wheel_3.first_limit": 0.025,
    }
    said = "at a limit of torque or momentum: 32 ticks (32.00%), wheel_1 first at 0.005 s"
    brief = analyze(log, in_brief=True)
    assert any(said in text for text in remarks(brief))
    asked = sizing_table(brief)
    assert asked is not None
    assert "what the law then asked for is not what the mission asks" in asked.notes[0]
    assert "torque_limits.base" not in report["metrics"]  # that of its hardware
    assert report["metrics"]["torque_limits.joints"] == 3.0
    unlimited = still_log(paper_robot, 10, hardware(wheels={"axes": PYRAMID}))
    unlimited.wheel_velocities[:] = unlimited.wheel_torques[:] = 1e6
    report = analyze(unlimited)
    assert report["metrics"]["wheels.saturation"] == 0
    assert not any("limit" in text for text in remarks(report))


@pytest.mark.parametrize("actuators", [LIMITED, FREE, IDEAL])
def test_a_base_that_gives_another_torque_missed_no_deadline(
    paper_robot: Robot, actuators: BaseActuatorSettings
) -> None:
    """The joints tell: they get what was commanded for the tick, or all of it came too late."""
    log = still_log(paper_robot, 100, actuators)
    rng = np.random.default_rng(0)
    assert log.commanded_torque is not None
    log.commanded_torque[:] = rng.normal(size=log.commanded_torque.shape)
    log.applied_torque[1:, 3:] = log.commanded_torque[:-1, 3:]
    found = analyze(log)["metrics"]
    assert found["commands.differing"] == (99 if actuators is IDEAL else 0)
    assert found["commands.compared"] == 99
    log.applied_torque[50] = log.applied_torque[49]
    found = analyze(log)["metrics"]
    assert found["commands.differing"] == (99 if actuators is IDEAL else 1)


def test_a_limit_cycle_is_said_with_its_frequency_and_a_burst_is_none() -> None:
    """A torque that oscillates at 5 Hz with a quarter of what it does, and one of 1 %."""
    log = flown(controller="ctc", duration=8.0)
    size = np.sqrt(2.0) * 0.25 * measure(log)["torque_4_6.rms"]
    wave, torque = np.sin(2.0 * np.pi * 5.0 * log.time)[:, np.newaxis], log.applied_torque.copy()
    log.applied_torque[:, 6:] += size * wave
    log.applied_torque[:, :3] += 1e-3 * wave
    (line,) = [text for text in remarks(analyze(log)) if "limit cycle" in text]
    assert line.startswith("limit cycle: torque_4_6 at 5 Hz with ")
    assert "base" not in line
    log.applied_torque[:] = torque
    log.applied_torque[log.time > 7.0, 6:] += 20.0 * wave[log.time > 7.0]
    assert not [text for text in remarks(analyze(log)) if "limit cycle" in text]


def test_joints_beyond_their_limits_are_said() -> None:
    """Where the file has limits, and not by rounding."""
    log = flown(controller="ctc", duration=0.01)
    log.scenario = None
    joints = find_robot("paper").content
    for number, link in enumerate(joints["robot"]["links"]):
        link["limits"] = [-3.0, 3.0, 2.0, 60.0] if number < 3 else [None] * 4
    log.flight["robot_file"] = joints
    log.joint_positions[:], log.joint_velocities[:], log.applied_torque[:] = 3.0, -2.0, 60.0
    report = analyze(log)
    beyond = with_statistic(report["metrics"], "beyond_effort")
    assert list(beyond) == ["joint1", "joint2", "joint3"]
    assert not [text for text in remarks(report) if "beyond" in text]
    log.applied_torque[:7, 4] = -60.1
    log.joint_positions[:2, 2], log.joint_velocities[3, 2] = -3.1, 2.1
    (line,) = [text for text in remarks(analyze(log)) if "beyond" in text]
    assert line == (
        "joints beyond the limits of the robot's file: joint2 (effort at 7 ticks), "
        "joint3 (position at 2 ticks, velocity at 1 ticks)"
    )
