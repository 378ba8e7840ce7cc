"""Flights whose wheels are unloaded by magnetic torquers: momentum, errors, bags, and lanes."""

from __future__ import annotations

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.integrate import solve_ivp
from scipy.interpolate import CubicSpline
from scipy.spatial.transform import Rotation

import space_robot as sr
from space_robot.analysis import tracking_error
from space_robot.flight.batch.sharing import batches
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import ACTUATOR_FIELDS, ORBIT_FIELDS, STATE_FIELDS
from space_robot_sim.plant.surroundings import REPORT_TICKS

Array = NDArray[np.float64]

AXES = np.array([[1, 1, 1], [-1, 1, 1], [-1, -1, 1], [1, -1, 1]]) / np.sqrt(3.0)
SPIN = 0.0318
"""Of the wheels in config/actuators/wheels_and_torquers.yaml: axes, and inertia, kg m2."""
GAIN = 0.005
"""1/s."""
REST_S = 40.0
"""The mission is over by then, and the arm stands."""
PERIOD = 0.005
OVER_THE_POLE = {"orbital_elements.inclination_deg": 80.0, "orbital_elements.anomaly_deg": 50.0}
"""The magnetic field turns away from the momentum that the wheels have at the start, along z."""


@cache
def flown(
    dump: str, duration: float = 240.0, law: str = "ctc", period: float = PERIOD
) -> FlightLog:
    """Fly with wheels that store 2.3 N m s about z at the start."""
    allocation = {"allocation.dump": dump, "allocation.magnetic_gain": GAIN}
    plan = FlightPlan(
        controller=law,
        actuators="wheels_and_torquers",
        orbit="iss",
        period=period,
        duration=duration,
        parameters={
            "controller": allocation,
            "plant": {"wheels.initial_speed": [31.4], **OVER_THE_POLE},
        },
    )
    return simulate(Flight(resolve(plan)))


def stored(log: FlightLog) -> Array:
    """Return the momentum (N, 3) of the wheels on base axes, N m s."""
    return np.asarray(SPIN * log.wheel_velocities @ AXES)


def on_inertial_axes(log: FlightLog, vectors: Array) -> Array:
    return np.asarray(Rotation.from_quat(np.roll(log.quaternion, -1, axis=1)).apply(vectors))


def test_momentum_goes_as_the_law_says() -> None:
    """``dh/dt = -k (h - (h . b) b) + T`` by SciPy, with the field and the torques T in the log.

    The dipoles are held over a tick, which takes ``1 - k period`` of the momentum, not an
    exponential's share.

    The base is held still and no dipole is at its limit, so that all momentum is the wheels'.
    """
    log, first = flown("magnetic"), round(REST_S / PERIOD)
    rows = log.rows(first, log.ticks)
    assert np.abs(rows.actuator_commands[:, 4:]).max() < 400.0
    momentum = on_inertial_axes(rows, stored(rows))
    told = slice(None, None, REPORT_TICKS)  # the torque of gravity is computed so often
    fields = on_inertial_axes(rows, rows.magnetic_field)[told]
    torques = rows.external_torques[told].reshape(-1, 4, 3).sum(axis=1)
    numbers = CubicSpline(rows.time[told], np.hstack([fields, torques]))

    k = -np.log1p(-GAIN * PERIOD) / PERIOD

    def rate(t: float, h: Array) -> Array:
        b, torque = np.split(numbers(t), 2)
        return np.asarray(-k * (h - (h @ b) * b / (b @ b)) + torque)

    times = rows.time[told][::10]  # 1 s
    expected = solve_ivp(
        rate, (times[0], times[-1]), momentum[0], t_eval=times, max_step=1.0, rtol=1e-9, atol=1e-12
    ).y.T
    assert np.linalg.norm(momentum[-1] - momentum[0]) > 0.5
    # the field is that at the begin of each tick, half a tick old: 2.5e-6 rad of its turning
    np.testing.assert_allclose(momentum[told][::10], expected, rtol=0.0, atol=1e-5)


def test_wheels_are_unloaded_and_without_torquers_are_not() -> None:
    with_torquers, without = (
        np.linalg.norm(stored(flown(dump)), axis=1) for dump in ("magnetic", "none")
    )
    last = round(REST_S / PERIOD)
    assert without[-1] > without[last] - 0.01
    assert with_torquers[-1] < 0.8 * without[-1]
    assert not flown("none").actuator_commands[:, 4:].any()


def test_the_laws_notice_nothing_of_it() -> None:
    """The errors of computed torque are the same to 1e-3 of their largest at every tick.

    Wheels hold against the torquers to rounding. What remains is the wheels' gyroscopic torque,
    which a law feels: it is that of the momentum that they have left.
    """
    one, other = tracking_error(flown("magnetic")), tracking_error(flown("none"))
    largest = np.abs(other).max()
    assert largest > 1e-6
    assert np.abs(one - other).max() < 1e-3 * largest
    rms, apart = (float(np.sqrt(np.mean(x**2))) for x in (other, one - other))
    assert apart < 1e-4 * rms


def test_nor_does_super_twisting() -> None:
    """Its errors are a ripple, which is another one at each tick, of the same size."""
    one, other = (
        tracking_error(flown(dump, duration=20.0, law="tde_stc", period=0.001))
        for dump in ("magnetic", "none")
    )
    for axes in (slice(0, 3), slice(3, None)):
        sizes = [float(np.sqrt(np.mean(error[:, axes] ** 2))) for error in (one, other)]
        assert sizes[0] == pytest.approx(sizes[1], rel=0.05)
        assert sizes[0] < 1e-6


@pytest.mark.parametrize("sensors", ["ideal", "fine"])
def test_the_base_gets_what_the_law_demands(sensors: str) -> None:
    """From torquers and wheels together, tick by tick, as it is commanded and applied."""
    plan = FlightPlan(
        actuators="wheels_and_torquers", orbit="sso_700", duration=0.2, sensors=sensors
    )
    log = simulate(Flight(resolve(plan)))
    motors, dipoles = log.actuator_commands[:, :4], log.actuator_commands[:, 4:]
    assert np.abs(dipoles).max() > 1.0
    of_torquers = np.cross(dipoles, log.magnetic_field)
    demand = log.commanded_torque[:, :3]
    np.testing.assert_allclose(of_torquers - motors @ AXES, demand, rtol=0.0, atol=1e-13)
    np.testing.assert_allclose(log.applied_torque[1:, :3], demand[:-1], rtol=0.0, atol=1e-13)
    np.testing.assert_array_equal(log.applied_torque[1:, 3:], log.commanded_torque[:-1, 3:])


def test_a_bag_has_dipoles_and_field_to_the_bit(tmp_path: Path) -> None:
    plan = FlightPlan(actuators="wheels_and_torquers", orbit="iss", duration=0.1, sensors="fine")
    flight = Flight(resolve(plan))
    log = simulate(flight, tmp_path / "bag")
    back = read_flight(tmp_path / "bag")
    assert back.damage == ()
    assert not any(back.lost.values())
    assert back.actuator_commands.shape == (200, 7)
    assert back.actuator_commands[:, 4:].any(axis=0).all()
    for name in (*STATE_FIELDS, *ACTUATOR_FIELDS, *ORBIT_FIELDS, "actuator_commands"):
        np.testing.assert_array_equal(getattr(back, name), getattr(log, name), name)
    sent = [data for _, data in open_bag(tmp_path / "bag").messages(topics.MAGNETOMETER)]
    assert len(sent) == 200
    torquers = back.flight["base_actuators"]["magnetic_torquers"]
    assert torquers["max_dipole"] == [400.0]
    assert flight.plant.names.torquers == ("torquer_1", "torquer_2", "torquer_3")


def test_while_a_state_is_not_usable_no_dipole_is_commanded() -> None:
    """The wheels' torques are held; a dipole would turn a base whose attitude is not known."""
    plan = FlightPlan(
        actuators="wheels_and_torquers",
        orbit="iss",
        duration=0.1,
        faults=["scaled_quaternion@0.05-0.06:1"],
    )
    log = simulate(Flight(resolve(plan)))
    bad = slice(101, 119)
    np.testing.assert_array_equal(log.actuator_commands[bad, 4:], 0.0)
    assert (log.actuator_commands[bad, :4] == log.actuator_commands[99, :4]).all()
    assert log.actuator_commands[121:, 4:].all()


def test_eight_flights_in_lanes_have_the_bits_of_each_alone() -> None:
    """In other orbits, with other momenta, gains and dipoles; a wheel fails in one of them."""
    elements = {"height": 500e3, "inclination_deg": 97.4, "anomaly_deg": 200.0}
    thin_air = {"atmosphere": {"density": 1e-14}}
    changes: list[dict[str, Any]] = [
        {},
        {"orbit": "sso_700"},
        {"orbit": "gto", "seed": 1},
        {"orbit": {"orbital_elements": elements, **thin_air, "magnetism": {"strength": 1e-5}}},
        {"parameters": {"controller": {"allocation.magnetic_gain": 0.0}}},
        {"parameters": {"plant": {"wheels.initial_speed": [100.0, -50.0, 0.0, 20.0]}}},
        {"parameters": {"plant": {"magnetic_torquers.max_dipole": [5.0, 50.0, 500.0]}}},
        {"faults": ["wheel_fail@0.03:2"], "case": "3"},
    ]
    common: dict[str, Any] = {
        "actuators": "wheels_and_torquers",
        "orbit": "iss",
        "sensors": "fine",
        "duration": 0.1,
    }
    scenarios = [sr.Scenario(**{**common, **change}) for change in changes]
    groups = [[number for number, _ in g] for g in batches(enumerate(s.check() for s in scenarios))]
    assert groups == [list(range(8))]
    dipoles = []
    for number, (flight, scenario) in enumerate(
        zip(sr.fly_many(scenarios), scenarios, strict=True)
    ):
        alone = scenario.fly()
        assert flight.outcome == alone.outcome
        columns = alone.log.columns
        assert {*ORBIT_FIELDS, "actuator_commands"} <= set(columns)
        for name, column in columns.items():
            assert flight.log.columns[name].tobytes() == column.tobytes(), f"{number} {name}"
        dipoles.append(flight.log.actuator_commands[:, 4:])
    assert len({column.tobytes() for column in dipoles}) == 8
    assert not dipoles[4].any()
    assert all(column.any() for k, column in enumerate(dipoles) if k != 4)
