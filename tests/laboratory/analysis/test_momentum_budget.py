"""Momentum of robot and wheels, and what comes from outside by source: a gyrostat that SciPy
integrates, and flights whose dipoles, air, thrusters and own disturbances are accounted for."""

from __future__ import annotations

import copy
import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from bags import messages_in
from benches import WHEEL_AXES as PYRAMID
from benches import flat, hardware, still_log
from oracles import pinocchio_model, rotation_of
from scipy.integrate import solve_ivp

from space_robot import Scenario
from space_robot.analysis import analyze, measure
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.momentum import MomentumSeries, whole_momentum
from space_robot.analysis.report_tables import comparison_table
from space_robot.analysis.words import analyzed
from space_robot_model.elementary.matrices import Array
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.samples import SOURCES

POSTURE = np.array([0.3, -0.8, 1.1, 0.2, -0.5, 0.9])
WHEELS = {"axes": PYRAMID, "rotor_inertia": [0.1, 0.2, 0.1, 0.3], "initial_speed": [20.0]}
ROWS, PERIOD = 401, 0.005
FIELD = {
    "orbital_elements": {"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 30.0},
    "gravity": {"gradient": False},
    "magnetism": {"strength": 2.98e-5, "residual_dipole": [10.0, -20.0, 30.0]},
}
ALL = {
    **FIELD,
    "gravity": {"gradient": True, "j2": True},
    "atmosphere": {"density": 3e-12, "at_height": 420e3},
    "sunlight": {"pressure": 4.56e-6, "noon_deg": 30.0},
}
TORQUED = Scenario(actuators="wheels_and_torquers", duration=2.0)
WIND = {
    "time": [0.1, 0.4, 0.8],
    "base_force_y": [0.5, -1.0, 2.0],
    "base_torque_x": [0.3, 0.3, -0.1],
    "joint2": [0.5, 0.0, 0.5],
}


def gyrostat_log(robot: Robot, actuators: BaseActuatorSettings) -> FlightLog:
    """The robot, its arm locked, turns and tumbles as SciPy integrates Euler's equations.

    Motors turn the wheels by torques known beforehand; thrusters push as `thrust` says.
    """
    model = pinocchio_model(robot)
    data = model.createData()
    pin.ccrba(model, data, np.concatenate([np.zeros(6), [1.0], POSTURE]), np.zeros(model.nv))
    inertia, com, mass = data.Ig.inertia.copy(), data.com[0].copy(), float(robot.mass.sum())
    wheels, thrusters = actuators.wheels, actuators.thrusters
    axes, spin = wheels.unit_axes, wheels.values("rotor_inertia")
    phases = np.arange(wheels.count)

    def thrust(t: float) -> Array:
        on = 1.0 + np.sin(3.0 * t + np.arange(thrusters.count))
        return on * thrusters.values("force")

    def rate(t: float, x: Array) -> Array:
        q, w, speed = x[:4], x[4:7], x[7 : 7 + wheels.count]
        motors = 0.5 * np.sin(2.0 * t + phases)
        force = thrust(t)[:, np.newaxis] * thrusters.unit_directions
        torque = np.cross(thrusters.places - com, force).sum(axis=0)
        h = inertia @ w + axes.T @ (spin * speed)
        bare = inertia - (axes.T * spin) @ axes
        wdot = np.linalg.solve(bare, torque - axes.T @ motors - np.cross(w, h))
        qdot = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        pushed = rotation_of(q / np.linalg.norm(q)).apply(force.sum(axis=0)) / mass
        return np.concatenate([qdot, wdot, motors / spin - axes @ wdot, x[-3:], pushed])

    log = still_log(robot, ROWS, actuators, PERIOD)
    start = np.concatenate(
        [[1.0, 0.0, 0.0, 0.0], [0.1, -0.2, 0.15], wheels.values("initial_speed"), com, np.zeros(3)]
    )
    found = solve_ivp(
        rate, (0.0, log.time[-1]), start, t_eval=log.time, rtol=1e-11, atol=1e-12, method="DOP853"
    ).y.T
    log.quaternion[:] = found[:, :4] / np.linalg.norm(found[:, :4], axis=1, keepdims=True)
    log.omega_base[:], log.joint_positions[:] = found[:, 4:7], POSTURE
    log.wheel_velocities[:] = found[:, 7 : 7 + wheels.count]
    turned = np.array([rotation_of(q).apply(com) for q in log.quaternion])
    log.base_position[:] = found[:, -6:-3] - turned
    log.thrusts[1:] = [thrust(t) for t in log.time[1:] - 0.5 * PERIOD]
    return log


def test_inner_torques_alone_move_momentum_but_do_not_change_it(paper_robot: Robot) -> None:
    actuators = hardware(wheels=WHEELS)
    log = gyrostat_log(paper_robot, actuators)
    report = analyze(log)
    found = report["metrics"]
    assert found["momentum_drift.relative"] < 1e-10
    assert found["momentum_robot.max"] > 100.0
    assert found["momentum_wheels.max"] > 1.0
    assert found["momentum_outside.max"] == 0.0
    assert "pushed.max" not in found
    log.wheel_velocities[200:] *= 1.001  # which no torque can do
    lost = measure(log)["momentum_drift.max"]
    spin = [0.1, 0.2, 0.1, 0.3] * log.wheel_velocities[200:] / 1001.0
    largest = np.linalg.norm(spin @ actuators.wheels.unit_axes, axis=1).max()
    assert lost == pytest.approx(largest, rel=1e-6)
    log.flight["case"] = "4-2"
    series = MomentumSeries(AnalysedLog(log))
    assert series._captures.robot_at(0).mass[-1] > paper_robot.mass[-1]
    assert series._disturbance.scale > 0.0


def test_what_thrusters_bring_is_accounted_for(paper_robot: Robot) -> None:
    """Their impulse by the mean force of an interval, its axes turned: right to its square."""
    rng = np.random.default_rng(5)
    thrusters = {
        "positions": flat(rng.uniform(-1.0, 1.0, (5, 3))),
        "directions": flat(rng.normal(size=(5, 3))),
        "force": [4.0],
    }
    actuators = hardware(wheels=WHEELS, thrusters=thrusters)
    log = gyrostat_log(paper_robot, actuators)
    found = measure(log)
    assert found["momentum_outside.max"] > 1.0
    assert found["momentum_drift.max"] < 1e-4 * found["momentum_outside.max"]
    pushed = np.linalg.norm(log.base_position - log.base_position[0], axis=1)
    assert found["pushed.end"] == pytest.approx(found["pushed.max"])
    assert 0.0 < found["pushed.end"] != pytest.approx(pushed[-1], rel=1e-3)


def test_what_disturbs_a_flight_is_accounted_for() -> None:
    """A base that floats freely, disturbed and with a payload that its arm does not know of."""
    log = Scenario(actuators="none", case="4-2", duration=0.5).fly().log
    found = measure(log)
    assert found["momentum_outside.max"] > 1e-3
    assert found["momentum_robot.max"] == pytest.approx(found["momentum_outside.max"])
    assert found["momentum_drift.max"] < 1e-9 * found["momentum_outside.max"]


def test_of_a_free_base_it_is_relative_to_the_bases(paper_robot: Robot) -> None:
    """The robot's momentum stays what it was, however small that is."""
    log = still_log(paper_robot, 5, BaseActuatorSettings(base_actuation="none"))
    found = measure(log)
    assert found["momentum_drift.max"] == 0.0
    assert "momentum_drift.relative" not in found
    log.omega_base[2] = [0.0, 0.0, 0.01]
    found = measure(log)
    share = found["momentum_drift.max"] / found["momentum_base.max"]
    assert found["momentum_drift.relative"] == pytest.approx(share)


def test_dipoles_are_accounted_for_to_rounding() -> None:
    """Those of torquers and that of the base: their torques are held on base axes over a tick.

    The torquers' torque is what the base is applied beyond its wheels' motors.
    """
    log = TORQUED.replace(orbit=FIELD).fly().log
    momentum = whole_momentum(log)
    rest = momentum.total - momentum.total[0] - momentum.outside
    size = np.linalg.norm(momentum.wheels, axis=1).max()
    assert size > 10.0
    assert np.linalg.norm(momentum.outside[-1]) > 1e-3
    assert np.abs(rest).max() < 1e-13 * size
    found = measure(log)
    assert found["momentum_drift.max"] == pytest.approx(np.linalg.norm(rest, axis=1).max())
    largest = np.linalg.norm(momentum.outside, axis=1).max()
    assert found["momentum_outside.max"] == pytest.approx(largest, rel=1e-14)


@pytest.mark.parametrize("case", ["1", "3"])
def test_the_report_has_the_columns_of_the_log_by_source(case: str) -> None:
    """And the sines of case 3: ``-0.01 (sin(pi t) + sin(1.5 pi t))`` on each inertial axis."""
    log = TORQUED.replace(orbit=ALL, case=case).fly().log
    found = measure(log)
    torques = {name: log.external_torques[:, 3 * k : 3 * k + 3] for k, name in enumerate(SOURCES)}
    if case == "3":
        wave = -0.01 * (np.sin(np.pi * log.time) + np.sin(1.5 * np.pi * log.time))
        torques["sines"] = np.repeat(wave[:, np.newaxis], 3, axis=1)
    rms = [name for name in found if name.startswith("disturbance_") and name.endswith("rms")]
    assert rms == [f"disturbance_{name}.rms" for name in torques]
    for name, torque in torques.items():
        sizes = np.linalg.norm(torque, axis=1)
        impulse = np.linalg.norm(log.timebase.period * np.cumsum(torque, axis=0), axis=1)
        expected = {
            f"disturbance_{name}.rms": np.sqrt(np.mean(sizes**2)),
            f"disturbance_{name}.max": sizes.max(),
            f"impulse_{name}.max": impulse.max(),
        }
        assert {key: found[key] for key in expected} == pytest.approx(expected, rel=1e-12), name
        assert found[f"disturbance_{name}.rms"] > 0.0


def test_the_users_torque_is_a_source_among_those_of_an_orbit() -> None:
    """And in the budget of momentum, unless the bag does not tell of it."""
    scenario = Scenario(orbit="iss", actuators="wheels", disturbance=WIND, duration=1.0)
    log = replace(scenario.fly().log, scenario=None)
    silent: Any = copy.deepcopy(dict(log.flight))
    del silent["scenario"]["disturbance"]
    del silent["disturbance"]
    aware, unaware = analyze(log), analyze(replace(log, flight=silent))
    assert aware["metrics"]["disturbance_own.max"] > 0.3 / 2.0
    assert "own" in str(comparison_table({"a": aware}))
    assert "disturbance_own.max" not in unaware["metrics"]
    drift, lost = (report["metrics"]["momentum_drift.max"] for report in (aware, unaware))
    assert lost > 0.1
    assert drift < 1e-5 * lost
    pure = {key: WIND[key] for key in ("time", "base_torque_x")}
    own = scenario.replace(disturbance=pure).fly().metrics["disturbance_own.max"]
    assert own == pytest.approx(0.3, rel=1e-9)


@pytest.mark.parametrize(("lost", "start", "stop"), [(4, 0.05, 0.1), (9, 0.0, 0.09)])
def test_ticks_whose_torques_are_lost_are_left_out(
    lost: int, start: float, stop: float, tmp_path: Path
) -> None:
    """As of a plant that was killed: its last ticks were not told yet."""
    flight = TORQUED.replace(orbit="iss", duration=0.1).fly(tmp_path / "whole")
    described = json.loads(open_bag(tmp_path / "whole").custom_data()["space_robot.flight"])
    recorder, chunk = BagRecorder(tmp_path / "bag", described, flight.flight.timebase), -1
    for name, data in messages_in(tmp_path / "whole"):
        chunk += name == topics.TRUTH_ORBIT.full_name
        if name != topics.TRUTH_ORBIT.full_name or chunk != lost:
            recorder.record(topics.BY_NAME[name], data)
    recorder.close()
    report = analyze(read_flight(tmp_path / "bag"))
    assert np.isfinite(report["metrics"]["disturbance_gravity_gradient.rms"])
    assert report["metrics"]["momentum_outside.max"] > 0.0
    assert (report["from_s"], report["to_s"]) == (start, stop)
    share = f"{(stop - start) / 0.1:.1%} of the flight, {report['ticks']} of 200 ticks"
    assert analyzed(report).startswith(share)
