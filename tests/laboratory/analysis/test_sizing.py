"""What a flight asks of its base: closed forms of a turning base, and plain loops."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from benches import THRUSTER_PAIRS, flat, hardware, still_log
from benches import WHEEL_AXES as PYRAMID
from oracles import quaternion_of
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot.analysis import analyze
from space_robot.analysis.report_tables import sizing_table
from space_robot.analysis.sizing import (
    ActuatorSet,
    BaseDemand,
    Demand,
    LoadRequirement,
    other_wheels,
)
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

PERIOD = 0.0005
PAIRS = {**THRUSTER_PAIRS, "specific_impulse": [200.0]}


def turning_log(robot: Robot, rate: float, ticks: int = 2001) -> FlightLog:
    """The base turns about z at a constant rate, asked for 2 N m about its own x."""
    log = still_log(robot, ticks)
    angle = rate * log.time
    log.quaternion[:, 0], log.quaternion[:, 3] = np.cos(angle / 2), np.sin(angle / 2)
    log.omega_base[:, 2] = rate
    log.applied_torque[1:, 0] = 2.0
    assert log.commanded_torque is not None
    log.commanded_torque[:, 0] = 2.0
    return log


def demand_of(log: FlightLog) -> Demand:
    return BaseDemand(log, BaseActuatorSettings()).of(0, log.ticks)


def test_stored_momentum_is_scipys_integral_of_any_motion(paper_robot: Robot) -> None:
    log = still_log(paper_robot, 2001)

    def turned(t: float) -> Rotation:
        return Rotation.from_euler("zyx", [np.sin(3.0 * t), 0.5 * t, np.cos(2.0 * t)])

    def torque(t: Any) -> Any:
        return np.array([np.sin(5.0 * t), 2.0 * np.cos(4.0 * t), 1.0 + 0.0 * t])

    log.quaternion[:] = [quaternion_of(turned(t)) for t in log.time]
    assert log.commanded_torque is not None
    log.commanded_torque[:, :3] = torque(log.time + 0.5 * PERIOD).T
    solved = solve_ivp(
        lambda t, _: turned(t).apply(torque(t)), (0.0, 1.0), np.zeros(3), rtol=1e-10, atol=1e-12
    )
    wanted = -turned(1.0).inv().apply(solved.y[:, -1])
    found = demand_of(log)
    np.testing.assert_allclose(found.momentum[-1], wanted, atol=1e-6)


def test_a_command_that_is_not_known_was_the_torque_given(paper_robot: Robot) -> None:
    log = turning_log(paper_robot, 0.0, 10)
    assert log.commanded_torque is not None
    log.commanded_torque[3] = np.nan
    log.applied_torque[4, :3] = [0.5, 0.0, 0.0]
    asked = demand_of(log).torque
    np.testing.assert_array_equal(asked[:, 0], [0.0, *[2.0] * 3, 0.5, *[2.0] * 5])
    log.commanded_torque = None
    np.testing.assert_array_equal(demand_of(log).torque, log.applied_torque[:, :3])


def test_axes_have_peak_rms_impulse_and_momentum(paper_robot: Robot) -> None:
    log = still_log(paper_robot, 2001)
    assert log.commanded_torque is not None
    log.commanded_torque[:1000, 1], log.commanded_torque[1000:, 1] = 3.0, -1.0
    report = analyze(log)
    found, prefix = report["metrics"], "sizing.base_y."
    assert {n.removeprefix(prefix): x for n, x in found.items() if n.startswith(prefix)} == {
        "peak_torque": 3.0,
        "rms_torque": pytest.approx(np.sqrt((9.0 * 1000 + 1000) / 2001)),
        "angular_impulse": pytest.approx(2.0),
        "peak_momentum": pytest.approx(1.5),
    }
    assert found["sizing.base_x.peak_momentum"] == 0.0
    assert found["sizing.peak_momentum"] == pytest.approx(1.5)
    assert report["sizing"] == {"actuators": "mine", "flown": True, "requirements": []}
    assert "momentum_robot.max" not in report["metrics"]
    assert "momentum" not in report["unavailable"]
    free = analyze(still_log(paper_robot, 9, BaseActuatorSettings(base_actuation="none")))
    assert free["sizing"] is None
    assert free["unavailable"]["sizing"] == "the base floated freely: nothing was asked of it"
    log.flight["base_actuators"] = hardware(wheels={"axes": PYRAMID}).model_dump()
    why = analyze(log)["unavailable"]["sizing"]
    assert "describes 4 wheels and 0 thrusters, and has the states of 0 and 0" in why


def test_wheels_that_flew_tell_by_their_own_columns(paper_robot: Robot) -> None:
    wheels = hardware(
        wheels={
            "axes": PYRAMID,
            "rotor_inertia": [0.1, 0.2, 0.3, 0.4],
            "max_torque": [1.0],
            "max_momentum": [4.0, 5.0, 4.0, 0.0],
            "initial_speed": [10.0],
        }
    )
    log = still_log(paper_robot, 10, wheels)
    log.wheel_velocities[:] = 10.0
    log.wheel_velocities[5] = [20.0, -25.0, 0.0, 11.0]
    log.wheel_torques[3] = [0.5, -1.0, 0.0, 0.0]
    found = analyze(log)["sizing"]["requirements"]
    of_wheels = [(r["asked"], r["has"], r["is_met"]) for r in found if "wheel" in r["part"]]
    assert of_wheels == [
        (0.5, 1.0, True),
        (2.0, 4.0, True),
        (1.0, 1.0, False),
        (5.0, 5.0, False),
        (0.0, 1.0, True),
        (3.0, 4.0, True),
        (0.0, 1.0, True),
        (pytest.approx(4.4), None, True),
    ]
    held = wheels.wheels.unit_axes.T @ ([0.1, 0.2, 0.3, 0.4] * (log.wheel_velocities[5] - 10.0))
    stored = [r["asked"] for r in found if r["quantity"] == "stored momentum"]
    assert stored == pytest.approx(np.abs(held))


def test_other_wheels_in_their_place_hold_what_was_asked(paper_robot: Robot) -> None:
    """Base and stored momentum turn: motors give ``P (dh/dt)``, and what friction takes."""
    wheels = hardware(
        wheels={
            "axes": PYRAMID,
            "rotor_inertia": [0.1],
            "initial_speed": [5.0, 50.0, -30.0, 20.0],
            "coulomb": [0.02],
            "viscous": [1e-3],
        }
    ).wheels
    log = turning_log(paper_robot, 2.0)
    demand = demand_of(log)
    torque, momentum = other_wheels(wheels, log, 0, demand)
    first = 0.1 * np.array([5.0, 50.0, -30.0, 20.0]) @ wheels.unit_axes
    turned = Rotation.from_quat(log.quaternion, scalar_first=True).inv().apply(first)
    np.testing.assert_allclose(
        momentum @ wheels.unit_axes, demand.momentum + turned, rtol=0.0, atol=1e-12
    )
    given = np.gradient(momentum, PERIOD, axis=0)
    friction = 0.02 * np.sign(momentum) + 1e-3 * momentum / 0.1
    inside = slice(2, -2)
    np.testing.assert_allclose((torque - friction)[inside], given[inside], atol=3e-3)


def test_at_its_limit_a_part_lacks_it() -> None:
    for asked, has, is_met, margin, is_at_limit in (
        (1.0, 4.0, True, 0.75, False),
        (3.999, 4.0, False, pytest.approx(0.00025), True),
        (3.99, 4.0, True, pytest.approx(0.0025), False),
        (0.0, 0.0, True, None, False),
        (9.0, np.inf, True, None, False),
    ):
        found = LoadRequirement("a", "b", "c", asked, has)
        assert (found.is_met, found.margin, found.is_at_limit) == (is_met, margin, is_at_limit)


def test_pulses_and_propellant_by_axis(paper_robot: Robot) -> None:
    thrusters = hardware(thrusters={**PAIRS, "propellant": 0.001})
    log = still_log(paper_robot, 60, thrusters)
    log.thrusts[5:15, 0] = log.thrusts[5:15, 1] = 2.0  # +z
    log.thrusts[20:25, 2] = 2.0  # -z
    log.thrusts[30, 2] = 1.0  # half a tick
    log.thrusts[40:60, 10] = 2.0  # -y
    report = analyze(log)
    metrics = report["metrics"]
    assert [metrics[f"sizing.base_{i}.pulses"] for i in "xyz"] == [0, 1, 4]
    rate = 2.0 / (200.0 * 9.80665) * PERIOD
    used = [metrics[f"sizing.base_{i}.propellant"] for i in "xyz"]
    assert used == [0.0, pytest.approx(20 * rate), pytest.approx(25.5 * rate)]
    (tank,) = [r for r in report["sizing"]["requirements"] if r["quantity"] == "propellant"]
    assert tank["asked"] == pytest.approx(45.5 * rate)
    assert tank["margin"] == pytest.approx(1 - 45500 * rate)
    assert (tank["has"], tank["is_met"]) == (0.001, True)


def test_of_other_thrusters_the_least_is_known_and_beside_wheels_nothing(
    paper_robot: Robot,
) -> None:
    log = turning_log(paper_robot, 0.0)
    report = analyze(log, ActuatorSet("pairs", hardware(thrusters=PAIRS)))
    found = report["sizing"]
    asked = {r["quantity"]: r for r in found["requirements"] if r["part"] == "thrusters"}
    assert asked["share of their torque"]["asked"] == pytest.approx(0.5)
    assert asked["propellant"]["asked"] == pytest.approx(2.0 * 1.0 / (200.0 * 9.80665))
    assert "sizing.base_x.pulses" not in report["metrics"]
    assert not found["flown"]
    both = hardware(thrusters=PAIRS, wheels={"axes": PYRAMID, "max_torque": [1.0]})
    report = analyze(log, ActuatorSet("both", both))
    found = report["sizing"]
    parts = {f"base_{axis}" for axis in "xyz"} | {f"wheel_{k}" for k in range(1, 5)}
    assert {r["part"] for r in found["requirements"]} == parts
    assert "sizing.base_x.propellant" not in report["metrics"]


def test_the_table_has_every_number_once(paper_robot: Robot) -> None:
    def table(**limits: float) -> tuple[list[str], dict[tuple[str, str], list[str]]]:
        wheels = {"axes": flat(np.eye(3)), **{name: [value] for name, value in limits.items()}}
        others = ActuatorSet("w", hardware(wheels=wheels)) if limits else None
        found = sizing_table(analyze(turning_log(paper_robot, 0.0), others))
        assert found is not None
        texts = {(g.name, row[0]): row[2:] for g in found.groups for row in found.texts(g)}
        return [column.heading for column in found.columns], texts

    headings, texts = table()
    assert headings == ["", "unit", "asked"]
    assert len(texts) == 3 * 4
    _, texts = table(max_torque=1.0, max_momentum=3.0)
    assert texts["base_x", "peak torque"] == ["2", "1", "-100 % lacks it"]
    assert texts["wheel_2", "largest momentum"] == ["0", "3", "+100 % has it"]
    assert len(texts) == 3 * 4 + 3 * 2
    for limit, margin in ((2.0, "at the limit"), (2.0001, "at the limit"), (0.08, "25 times")):
        assert table(max_torque=limit)[1]["base_x", "peak torque"][2] == margin
