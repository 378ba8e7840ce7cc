"""Momentum of robot and wheels: a gyrostat that SciPy integrates, pushed from outside or not."""

from __future__ import annotations

from typing import Any

import numpy as np
import pinocchio as pin
import pytest
from actuator_sets import PYRAMID, flat, hardware, still_log
from numpy.typing import NDArray
from oracles import pinocchio_model, rotation_of
from scipy.integrate import quad, solve_ivp

from space_robot.analysis import analyze
from space_robot.analysis.described import momentum_of
from space_robot.analysis.momentum import MomentumBudget, MomentumSeries, disturbance_impulse
from space_robot.analysis.report_tables import comparison_table
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_sim.environment.captures import Captures
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.orbit_settings import OrbitSettings

Array = NDArray[np.float64]
POSTURE = np.array([0.3, -0.8, 1.1, 0.2, -0.5, 0.9])
WHEELS = {"axes": PYRAMID, "rotor_inertia": [0.1, 0.2, 0.1, 0.3], "initial_speed": [20.0]}
NO_DISTURBANCE = DisturbanceSettings()
ROWS = 401
PERIOD = 0.005


def locked(robot: Robot) -> tuple[Array, Array, float]:
    """Inertia about the common CoM, that CoM (base axes) and mass of the robot in `POSTURE`."""
    model = pinocchio_model(robot)
    data = model.createData()
    q = np.concatenate([np.zeros(6), [1.0], POSTURE])
    pin.ccrba(model, data, q, np.zeros(model.nv))
    return data.Ig.inertia.copy(), data.com[0].copy(), float(robot.mass.sum())


def gyrostat_log(robot: Robot, actuators: BaseActuatorSettings) -> FlightLog:
    """The robot, its arm locked, turns and tumbles as SciPy integrates Euler's equations.

    Motors turn the wheels by torques known beforehand; thrusters push as `thrust` says.
    """
    inertia, com, mass = locked(robot)
    wheels, thrusters = actuators.wheels, actuators.thrusters
    axes, spin = wheels.unit_axes, wheels.values("rotor_inertia")
    phases = np.arange(wheels.count)

    def thrust(t: float) -> Array:
        on = 1.0 + np.sin(3.0 * t + np.arange(thrusters.count))
        return on * thrusters.values("force")

    def rate(t: float, x: Array) -> Array:
        q, w, speed = x[:4], x[4:7], x[7 : 7 + wheels.count]
        motors = 0.5 * np.sin(2.0 * t + phases)
        force = thrust(t) @ thrusters.unit_directions
        torque = np.cross(
            thrusters.places - com, thrusters.unit_directions * thrust(t)[:, None]
        ).sum(axis=0)
        h = inertia @ w + axes.T @ (spin * speed)
        bare = inertia - (axes.T * spin) @ axes
        wdot = np.linalg.solve(bare, torque - axes.T @ motors - np.cross(w, h))
        qdot = 0.5 * np.array([-q[1:] @ w, *(q[0] * w + np.cross(q[1:], w))])
        pushed = rotation_of(q / np.linalg.norm(q)).apply(force) / mass
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
    turned = _turned(log.quaternion, com)
    log.base_position[:] = found[:, -6:-3] - turned
    middle = log.time - 0.5 * PERIOD
    log.thrusts[1:] = [thrust(t) for t in middle[1:]]
    return log


def _turned(quaternion: Array, vector: Array) -> Array:
    return np.array([rotation_of(q).apply(vector) for q in quaternion])


def budget(log: FlightLog, robot: Robot, actuators: BaseActuatorSettings, *cuts: int) -> Any:
    metric = MomentumBudget(
        MomentumSeries(Captures((), robot, PERIOD, OrbitSettings()), actuators, NO_DISTURBANCE)
    )
    for start, stop in zip((0, *cuts), (*cuts, log.ticks), strict=True):
        metric.add(log.rows(start, stop), np.empty(0))
    return metric.result()


def test_inner_torques_alone_move_momentum_but_do_not_change_it(paper_robot: Robot) -> None:
    actuators = hardware(wheels=WHEELS)
    log = gyrostat_log(paper_robot, actuators)
    found = budget(log, paper_robot, actuators)
    assert found["drift"]["relative"] < 1e-10
    assert found["peak_n_m_s"]["robot"] > 100.0
    assert found["peak_n_m_s"]["wheels"] > 1.0
    assert found["peak_n_m_s"]["outside"] == 0.0
    assert found["pushed_m"] is None
    log.wheel_velocities[200:] *= 1.001  # which no torque can do
    lost = budget(log, paper_robot, actuators)["drift"]["n_m_s"]
    spin = [0.1, 0.2, 0.1, 0.3] * log.wheel_velocities[200:] / 1001.0
    assert lost == pytest.approx(
        np.linalg.norm(spin @ actuators.wheels.unit_axes, axis=1).max(), rel=1e-6
    )


def test_what_thrusters_bring_is_accounted_for(paper_robot: Robot) -> None:
    """Their impulse by the mean force of an interval, its axes turned: right to its square."""
    rng = np.random.default_rng(5)
    actuators = hardware(
        wheels=WHEELS,
        thrusters={
            "positions": flat(rng.uniform(-1.0, 1.0, (5, 3))),
            "directions": flat(rng.normal(size=(5, 3))),
            "force": [4.0],
        },
    )
    log = gyrostat_log(paper_robot, actuators)
    found = budget(log, paper_robot, actuators)
    assert found["peak_n_m_s"]["outside"] > 1.0
    assert found["drift"]["n_m_s"] < 1e-4 * found["peak_n_m_s"]["outside"]
    pushed = np.linalg.norm(log.base_position - log.base_position[0], axis=1)
    assert found["pushed_m"]["end"] == pytest.approx(found["pushed_m"]["max"])
    assert 0.0 < found["pushed_m"]["end"] != pytest.approx(pushed[-1], rel=1e-3)
    for cuts in ((1,), (7, 200)):
        again = budget(log, paper_robot, actuators, *cuts)
        assert again["drift"]["n_m_s"] == pytest.approx(found["drift"]["n_m_s"], rel=1e-6)
        assert again["peak_n_m_s"] == pytest.approx(found["peak_n_m_s"], rel=1e-12)
        assert again["pushed_m"] == pytest.approx(found["pushed_m"], rel=1e-12)


def test_pushing_is_of_the_centre_of_mass(paper_robot: Robot) -> None:
    """A force of 8 N along x for 2 s on 860 kg that does not turn."""
    actuators = hardware(
        thrusters={"positions": [0.0, 0.0, 0.0], "directions": [1.0, 0.0, 0.0], "force": [8.0]}
    )
    log = still_log(paper_robot, ROWS, actuators, PERIOD)
    log.thrusts[1:] = 8.0
    log.base_position[:, 0] = 0.5 * 8.0 / paper_robot.mass.sum() * log.time**2
    found = budget(log, paper_robot, actuators)
    assert found["pushed_m"]["end"] == pytest.approx(0.5 * 8.0 / 860.0 * 4.0)


def test_the_disturbances_impulse_is_its_integral() -> None:
    disturbance = DisturbanceSettings(scale=2.0, base_frequencies=[0.5, 0.0])

    def wave(t: float) -> float:
        return -2.0 * disturbance.base_amplitude * float(np.sin(2.0 * np.pi * 0.5 * t))

    for time in (0.3, 1.0, 7.7):
        wanted = quad(wave, 0.0, time)[0]
        assert disturbance_impulse(disturbance, np.array([time]))[0] == pytest.approx(wanted)


def test_what_disturbs_a_flight_is_accounted_for() -> None:
    """A base that floats freely, disturbed and with a payload that its arm does not know of."""
    log = simulate(Flight(resolve(FlightPlan(actuators="none", case="4-2", duration=0.5))))
    found = analyze(log)["momentum"]
    assert found["peak_n_m_s"]["outside"] > 1e-3
    assert found["peak_n_m_s"]["robot"] == pytest.approx(found["peak_n_m_s"]["outside"])
    assert found["drift"]["n_m_s"] < 1e-9 * found["peak_n_m_s"]["outside"]


def test_report_and_tables_have_it_of_bases_with_hardware(paper_robot: Robot) -> None:
    actuators = hardware(wheels=WHEELS)
    log = gyrostat_log(paper_robot, actuators)
    report = analyze(log)
    assert report["momentum"]["drift"]["relative"] < 1e-10
    table = comparison_table({"flight": report})
    texts = {(g.name, row[0]): row[1] for g in table.groups for row in table.texts(g)}
    peak = report["momentum"]["peak_n_m_s"]["robot"]
    assert texts["momentum", "robot at most (N m s)"] == f"{peak:.4g}"
    assert ("momentum", "drift, relative") in texts


def test_of_a_free_base_it_is_relative_to_the_bases(paper_robot: Robot) -> None:
    """The robot's momentum stays what it was, however small that is."""
    free = BaseActuatorSettings(base_actuation="none")
    log = still_log(paper_robot, 5, free)
    report = analyze(log)
    assert report["momentum"]["drift"] == {"n_m_s": 0.0, "relative": None}
    log.omega_base[2] = [0.0, 0.0, 0.01]
    found = analyze(log)["momentum"]
    assert found["drift"]["relative"] == pytest.approx(
        found["drift"]["n_m_s"] / found["peak_n_m_s"]["base"]
    )


def test_payload_and_disturbance_are_those_of_the_case(paper_robot: Robot) -> None:
    log = still_log(paper_robot, 5, hardware(wheels=WHEELS))
    log.flight["case"] = "4-2"
    series = momentum_of(log)
    assert series._captures.robot_at(0).mass[-1] > paper_robot.mass[-1]
    assert series._disturbance.scale > 0.0
