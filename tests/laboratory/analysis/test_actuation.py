"""Saturation, latency, and commands that were not applied."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from random_logs import random_log

from space_robot.analysis import analyze
from space_robot.analysis.actuation import (
    Latency,
    MissedDeadlines,
    Saturation,
    StandingJoints,
    TorqueLimits,
)
from space_robot.analysis.words import remarks
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.robot.find import find_robot, robot_names
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

NONE = TorqueLimits(np.inf, np.inf)
SOME = TorqueLimits(2.0, 1.5)


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(resolve(FlightPlan.model_validate({"duration": 0.2, **options}))))


def differing(log: FlightLog, latency_ticks: int, limits: TorqueLimits) -> tuple[int, int]:
    figure = MissedDeadlines(latency_ticks, limits)
    figure.add(log, np.empty(0))
    return figure.differing, figure.compared


@pytest.mark.parametrize("ticks", [0, 1, 4])
def test_in_lockstep_every_command_is_applied(ticks: int) -> None:
    log = flown(command_latency_ticks=ticks)
    assert differing(log, ticks, NONE) == (0, 399 - ticks)
    assert differing(log, ticks + 1, NONE)[0] > 300


def test_a_command_held_is_one_that_differs() -> None:
    log = flown()
    log.applied_torque[100] = log.applied_torque[99]
    assert differing(log, 0, NONE) == (1, 399)


def test_ticks_without_a_command_are_not_compared() -> None:
    log = flown()
    assert log.commanded_torque is not None
    log.commanded_torque[50:60] = np.nan
    assert differing(log, 0, NONE) == (0, 389)


@pytest.mark.parametrize("commands", [None, np.full((20, 9), np.nan)])
def test_without_commands_nothing_is_known(commands: np.ndarray | None) -> None:
    log = flown(duration=0.01)
    log.commanded_torque = commands
    report = analyze(log)
    assert report["missed_deadlines"] is None
    assert report["unavailable"]["missed_deadlines"] == "the commands were not recorded"


@given(st.sampled_from([1, 3, 6, 7]), st.integers(0, 99), st.integers(0, 4), st.integers(0, 60))
def test_missed_deadlines_and_saturation_are_those_of_plain_loops(
    n: int, seed: int, latency_ticks: int, cut: int
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
    missed_deadlines, saturation = MissedDeadlines(latency_ticks, SOME), Saturation(SOME)
    for start, stop in ((0, cut), (cut, min(cut + 1, 60)), (min(cut + 1, 60), 60)):
        if start < stop:
            missed_deadlines.add(log.rows(start, stop), np.empty(0))
            saturation.add(log.rows(start, stop), np.empty(0))
    assert (missed_deadlines.differing, missed_deadlines.compared) == (differ, compared)
    assert saturation.result() == {
        "base_torque_limit_n_m": 2.0,
        "joint_torque_limit_n_m": 1.5,
        "ticks": saturated,
        "share": saturated / 60,
    }


def test_saturation_is_the_plants() -> None:
    parameters = {"plant": {"base_torque_limit": 0.05, "joint_torque_limit": 0.02}}
    flight = Flight(resolve(FlightPlan(duration=0.2, parameters=parameters)))
    log = simulate(flight)
    log.flight["parameters"] = {"plant": {"case": "1", **parameters["plant"]}}
    limits = TorqueLimits(0.05, 0.02)
    report = analyze(log)
    counted = report["saturation"]["ticks"]
    # the plant's own count has no torque at tick 0, but one more at the end
    assert 0 < counted <= flight.plant.saturated_ticks <= counted + 1
    assert differing(log, 0, limits) == (0, 399)
    assert report["missed_deadlines"] == {
        "unanswered_ticks": 0,
        "compared_ticks": 399,
        "differing_ticks": 0,
    }
    assert differing(log, 0, NONE)[0] > 0
    assert report["saturation"]["base_torque_limit_n_m"] == 0.05
    assert report["saturation"]["joint_torque_limit_n_m"] == 0.02
    assert report["saturation"]["share"] == counted / 400


def test_each_axis_has_its_own_limit() -> None:
    log = random_log(3, 10, 0)
    log.applied_torque[:] = 0.0
    log.applied_torque[2, 2] = -2.0  # the base's last axis, at its limit
    log.applied_torque[4, 2] = 1.9
    log.applied_torque[6, 3] = 1.5  # the first joint
    log.applied_torque[8, 5] = -1.4
    figure = Saturation(SOME)
    figure.add(log, np.empty(0))
    assert figure.result()["ticks"] == 2


def test_without_limits_the_report_says_so() -> None:
    report = analyze(flown(duration=0.01))["saturation"]
    assert report == {
        "base_torque_limit_n_m": None,
        "joint_torque_limit_n_m": None,
        "ticks": 0,
        "share": 0.0,
    }


def test_percentiles_of_the_latency() -> None:
    log = random_log(1, 102, 0)
    log.latency_s = np.append(np.arange(101.0, 0.0, -1.0) * 1e-5, np.nan)
    for cuts in ((0, 102), (0, 7, 102)):
        figure = Latency(0.0005)
        for start, stop in itertools.pairwise(cuts):
            figure.add(log.rows(start, stop), np.empty(0))
        found = figure.result()
        assert found["answers"] == 101
        assert found["p50_ms"] == pytest.approx(0.51)
        assert found["p99_ms"] == pytest.approx(1.0)
        assert found["max_ms"] == pytest.approx(1.01)
        assert found["p50_ticks"] == pytest.approx(1.02)
        assert found["p99_ticks"] == pytest.approx(2.0)
        assert found["max_ticks"] == pytest.approx(2.02)


@pytest.mark.parametrize("latency", [None, np.full(102, np.nan)])
def test_without_answers_there_is_no_latency(latency: np.ndarray | None) -> None:
    log, figure = random_log(1, 102, 0), Latency(0.0005)
    log.latency_s = latency
    figure.add(log, np.empty(0))
    with pytest.raises(InputError, match="not flown as a graph"):
        figure.result()
    assert "not flown as a graph" in analyze(flown(duration=0.01))["unavailable"]["latency"]


def test_joints_stand_where_they_were_to_move() -> None:
    """By the way: the slow start of a motion counts for little, a joint that holds not at all."""
    log = FlightLog.allocate(400, ("a", "b", "c"), Timebase(500_000_000))
    ramp = np.linspace(0.0, 1.0, 400)
    log.reference_joints[:, 1, 0], log.reference_joints[:, 1, 1] = ramp, -ramp
    log.joint_velocities[:], log.reference_joints[:, :, 2] = 0.0, 0.0
    log.joint_velocities[:, 0] = ramp
    log.joint_velocities[100:, 1] = -0.5 * ramp[100:]
    metric = StandingJoints(log.rows(0, 1))
    for rows in (log.rows(0, 150), log.rows(150, 400)):
        metric.add(rows, np.empty(0))
    assert metric.result() == {"a": 0.0, "b": pytest.approx(0.0625, abs=1e-3)}


@pytest.mark.parametrize("case", ["1", "3"])
@pytest.mark.parametrize("law", ["tde_stc", "ctc", "pd"])
def test_shipped_flights_end_without_a_remark_on_them(law: str, case: str) -> None:
    log = simulate(Flight(resolve(FlightPlan(controller=law, case=case, duration=6.0))))
    said = " ".join(remarks(analyze(log)))
    assert "limit" not in said
    assert "stood" not in said


def test_friction_and_a_weak_law_are_said_at_the_end() -> None:
    """Joints held by 2 N m, of which the law is weak on three."""
    weak = {f"pd.{name}": [1e4] * 6 + [5.0] * 3 for name in ("k_p", "k_d")}
    own = {"plant": {"friction.coulomb": 2.0}, "controller": weak}
    log = simulate(Flight(resolve(FlightPlan(controller="pd", duration=4.0, parameters=own))))
    report = analyze(log)
    assert report["standing"]["joint4"] > 0.3
    (line,) = [text for text in remarks(report) if "stood still" in text]
    assert f"joint4 {report['standing']['joint4']:.0%}" in line


def test_a_limit_cycle_is_said_with_its_frequency() -> None:
    """A torque that oscillates at 5 Hz with a quarter of what it does, and one of 1 %."""
    log = simulate(Flight(resolve(FlightPlan(controller="ctc", duration=6.0))))
    report = analyze(log)
    size = np.sqrt(2.0) * 0.25 * report["rms"]["mean_axis"]["torque_4_6"]
    log.applied_torque[:, 6:] += size * np.sin(2.0 * np.pi * 5.0 * log.time)[:, np.newaxis]
    log.applied_torque[:, :3] += 1e-3 * np.sin(2.0 * np.pi * 5.0 * log.time)[:, np.newaxis]
    (line,) = [text for text in remarks(analyze(log)) if "limit cycle" in text]
    assert line.startswith("limit cycle: torque_4_6 at 5 Hz with ")
    assert "base" not in line


def test_a_burst_is_no_limit_cycle() -> None:
    """The same one, on the last second of eight."""
    log = simulate(Flight(resolve(FlightPlan(controller="ctc", duration=8.0))))
    burst = 20.0 * np.sin(2.0 * np.pi * 5.0 * log.time) * (log.time > 7.0)
    log.applied_torque[:, 6:] += burst[:, np.newaxis]
    assert not [text for text in remarks(analyze(log)) if "limit cycle" in text]


def test_joints_beyond_their_limits_are_said() -> None:
    """Where the file has limits, and not by rounding."""
    log = simulate(Flight(resolve(FlightPlan(controller="ctc", duration=0.01))))
    joints = find_robot("paper").content
    for number, body in enumerate(body for body in joints["robot"]["bodies"] if body["joint"]):
        body["joint"]["limits"] = [-3.0, 3.0, 2.0, 60.0] if number < 3 else [None] * 4
    log.flight["robot_file"] = joints
    log.joint_positions[:], log.joint_velocities[:], log.applied_torque[:] = 3.0, -2.0, 60.0
    report = analyze(log)
    assert list(report["beyond_limits"]) == ["joint1", "joint2", "joint3"]
    assert not [text for text in remarks(report) if "beyond" in text]
    log.applied_torque[:7, 4] = -60.1
    log.joint_positions[:2, 2], log.joint_velocities[3, 2] = -3.1, 2.1
    (line,) = [text for text in remarks(analyze(log)) if "beyond" in text]
    assert line == (
        "joints beyond the limits of the robot's file: joint2 (effort at 7 ticks), "
        "joint3 (position at 2 ticks, velocity at 1 ticks)"
    )


@pytest.mark.parametrize("name", robot_names())
def test_shipped_robots_keep_to_the_limits_of_their_files(name: str) -> None:
    log = simulate(Flight(resolve(FlightPlan(robot=name, controller="ctc", duration=3.0))))
    assert not [text for text in remarks(analyze(log)) if "beyond" in text]
