"""Motion of a rigid robot in orbit: librations, and Clohessy and Wiltshire's relative motion."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray
from oracles import quaternion_of
from orbiting_robots import (
    EARTH_RADIUS,
    MU,
    coast,
    mean_motion,
    orbiting_plant,
    rigid_robot,
    set_motion,
)
from scipy.optimize import brentq, least_squares
from scipy.spatial.transform import Rotation
from scipy.special import ellipk

Array = NDArray[np.float64]

SEMI_MAJOR_AXIS = EARTH_RADIUS + 400e3
N = mean_motion(SEMI_MAJOR_AXIS)
"""rad/s."""
ORBIT_S = 2.0 * np.pi / N
ROLL, PITCH, YAW = 50.0, 60.0, 20.0
"""Moments of inertia about the velocity, the normal of the orbit and the vertical, kg m2."""
LIBRATION_S = ORBIT_S / np.sqrt(3.0 * (ROLL - YAW) / PITCH)
"""Small librations in the plane of the orbit."""
DRIFT = 12.0 * np.pi
ORBIT_TICKS = 11000
PERIOD = ORBIT_S / ORBIT_TICKS
"""Half a second, and an orbit is a whole number of ticks."""


def attitudes(period: float, start: Rotation, ticks: int, skipped: int = 1) -> Array:
    """Return rotation vectors (K, 3) on the orbit's axes: vertical, velocity, normal.

    The robot's z lies along the normal of an equatorial orbit, its x along the vertical; it turns
    with the orbit, but for the rotation ``start``.
    """
    robot = rigid_robot(100.0, [YAW, ROLL, PITCH])
    plant = orbiting_plant(robot, period, initial_quaternion=quaternion_of(start).tolist())
    set_motion(plant, omega=[0.0, 0.0, N])
    states = [coast(plant, skipped).copy() for _ in range(ticks // skipped)]
    x, y, _ = np.transpose([state.orbit_position for state in states])
    orbit = Rotation.from_rotvec(np.outer(np.arctan2(y, x), [0.0, 0.0, 1.0]))
    quaternions = np.array([state.quaternion for state in states])
    turns = orbit.inv() * Rotation.from_quat(np.roll(quaternions, -1, axis=1))
    return np.asarray(turns.as_rotvec())


def pitch_period(period: float, amplitude: float, swings: int = 3) -> float:
    """Return the time between zero crossings of the pitch, two by two, s."""
    skipped = max(1, round(2.0 / period))
    ticks = int((swings + 0.5) * LIBRATION_S / period)
    pitch = attitudes(period, Rotation.from_euler("z", amplitude), ticks, skipped)[:, 2]
    k = np.flatnonzero(pitch[:-1] * pitch[1:] < 0.0)
    crossings = period * skipped * (k + pitch[k] / (pitch[k] - pitch[k + 1]))
    assert len(crossings) >= 2 * swings
    return float(2.0 * (crossings[-1] - crossings[0]) / (len(crossings) - 1))


def test_pitch_librates_at_the_frequency_of_the_formula() -> None:
    """``n sqrt(3 (I_roll - I_yaw) / I_pitch)`` to 1e-4, of an amplitude of 0.01 rad.

    To 1e-8, if the period of a pendulum of that amplitude is taken: the pitch's equation is
    ``I_pitch phi'' = -3/2 n^2 (I_roll - I_yaw) sin(2 phi)``.
    """
    amplitude = 0.01
    measured = pitch_period(PERIOD, amplitude)
    assert measured == pytest.approx(LIBRATION_S, rel=1e-4)
    pendulum = LIBRATION_S * 2.0 / np.pi * ellipk(np.sin(amplitude) ** 2)
    assert measured == pytest.approx(pendulum, rel=1e-8)


def test_large_librations_have_the_period_of_a_pendulum() -> None:
    pendulum = LIBRATION_S * 2.0 / np.pi * ellipk(np.sin(0.7) ** 2)
    assert pendulum > 1.1 * LIBRATION_S
    assert pitch_period(2.0, 0.7) == pytest.approx(pendulum, rel=1e-8)


def test_the_step_converges_with_its_fourth_power() -> None:
    """Of steps of minutes, beside one of 5 s; what is left at 0.5 s is far below rounding."""
    amplitude = 0.01
    ends = [
        attitudes(step, Rotation.from_euler("z", amplitude), round(48 * 160.0 / step))[-1, 2]
        for step in (160.0, 80.0, 40.0)
    ]
    fine = attitudes(5.0, Rotation.from_euler("z", amplitude), 48 * 32)[-1, 2]
    errors = [abs(end - fine) for end in ends]
    assert errors[0] / errors[1] == pytest.approx(16.0, rel=0.35)
    assert errors[1] / errors[2] == pytest.approx(16.0, rel=0.35)
    assert errors[2] < 1e-3 * amplitude


def test_roll_and_yaw_librate_together_at_two_frequencies() -> None:
    """The roots of ``s^4 + n^2 (1 + 3 k + k l) s^2 + 4 n^4 k l`` (Hughes, section 9.2).

    ``k = (I_pitch - I_yaw) / I_roll``, ``l = (I_pitch - I_roll) / I_yaw``. Both frequencies are
    fitted to the motion, of 1e-3 rad.
    """
    k, of_yaw = (PITCH - YAW) / ROLL, (PITCH - ROLL) / YAW
    squares = np.roots([1.0, -(1.0 + 3.0 * k + k * of_yaw), 4.0 * k * of_yaw])
    expected = N * np.sqrt(np.sort(squares))
    period, skipped = 2.0, 20
    ticks = int(3.0 * 2.0 * np.pi / expected[0] / period)
    start = Rotation.from_rotvec([1e-3, -0.7e-3, 0.0])
    motion = attitudes(period, start, ticks, skipped)[:, :2]
    time = period * skipped * np.arange(1, len(motion) + 1)

    def residual(frequencies: Array) -> Array:
        phase = np.outer(time, frequencies)
        waves = np.hstack([np.cos(phase), np.sin(phase)])
        fit = np.linalg.lstsq(waves, motion, rcond=None)[0]
        return np.ravel(waves @ fit - motion)

    fit = least_squares(residual, 1.02 * expected, x_scale=N, xtol=1e-12, ftol=1e-12)
    np.testing.assert_allclose(fit.x, expected, rtol=1e-5)
    assert np.abs(fit.fun).max() < 1e-8


def rotating(angle: float) -> Array:
    """Return the axes vertical, velocity, normal of an equatorial orbit, as columns."""
    return Rotation.from_euler("z", angle).as_matrix()


def clohessy_wiltshire(place: Array, motion: Array, time: float) -> Array:
    """Return the relative position (3,) after ``time``, on the rotating axes, m."""
    (x, y, z), (vx, vy, vz) = place, motion
    s, c = np.sin(N * time), np.cos(N * time)
    return np.array(
        [
            (4.0 - 3.0 * c) * x + s / N * vx + 2.0 / N * (1.0 - c) * vy,
            6.0 * (s - N * time) * x
            + y
            - 2.0 / N * (1.0 - c) * vx
            + (4.0 * s - 3.0 * N * time) / N * vy,
            c * z + s / N * vz,
        ]
    )


def free_points(place: Array, motion: Array, times: Array) -> Array:
    """Return relative positions (K, 3) of a free robot, rotating axes, m; ``times`` in ticks."""
    plant = orbiting_plant(rigid_robot(100.0, [20.0] * 3), PERIOD)
    velocity = motion + np.cross([0.0, 0.0, N], place)
    set_motion(plant, position=place, velocity=velocity)
    places = []
    for tick in times:
        state = coast(plant, int(tick) - plant.tick)
        places.append(rotating(N * tick * PERIOD).T @ state.base_position)
    return np.array(places)


DIRECTIONS = {
    "ahead": ([0.0, 1.0, 0.0], [0.0, 0.0, 0.0]),
    "above": ([1.0, 0.0, 0.0], [0.0, 0.0, 0.0]),
    "beside": ([0.0, 0.0, 1.0], [0.0, 0.0, 0.3]),
    "round": ([0.5, 0.2, 0.1], [0.2, -1.0, 0.1]),
    "any": ([0.4, -0.6, 0.5], [0.7, 0.3, -0.8]),
}
"""Places and velocities, in units of a distance d and of n d."""


@pytest.mark.parametrize("name", DIRECTIONS)
def test_a_free_robot_moves_as_hills_equations_say(name: str) -> None:
    """Over an orbit, to `DRIFT` times ``D^2 / R``, D the farthest distance: the rest is quadratic.

    An offset of height, also one of ``D^2 / R``, drifts along the orbit by 12 pi times as much.
    """
    place, motion = (np.array(values) for values in DIRECTIONS[name])
    ticks = np.linspace(1, ORBIT_TICKS, 13).astype(int)
    shares = []
    for distance in (10.0, 1000.0):
        start, speed = distance * place, N * distance * motion
        flown = free_points(start, speed, ticks)
        linear = [clohessy_wiltshire(start, speed, tick * PERIOD) for tick in ticks]
        farthest = np.linalg.norm(flown, axis=1).max()
        apart = np.linalg.norm(flown - linear, axis=1).max()
        shares.append(apart / (farthest**2 / SEMI_MAJOR_AXIS))
    assert shares[0] < DRIFT
    # the next order is smaller by D / R, and the share of a hundredth of the distance the same
    assert shares[0] == pytest.approx(shares[1], rel=4.0 * farthest / SEMI_MAJOR_AXIS)


def test_the_drift_in_an_orbit_is_that_of_clohessy_and_wiltshire() -> None:
    """``-12 pi x - 6 pi / n vy`` along the orbit; none where ``vy = -2 n x``."""
    for x, vy in ((0.02, 0.0), (0.0, 3e-5), (0.02, -0.04 * N)):
        start, motion = np.array([x, 0.0, 0.0]), np.array([0.0, vy, 0.0])
        drift = -DRIFT * x - 6.0 * np.pi / N * vy
        (end,) = free_points(start, motion, np.array([ORBIT_TICKS]))
        farthest = max(2.0 * x, abs(drift))
        assert end[1] == pytest.approx(drift, abs=DRIFT * farthest**2 / SEMI_MAJOR_AXIS)


def kepler(position: Array, velocity: Array, time: float) -> Array:
    """Return the position after ``time`` on an ellipse, by Kepler's equation in differences."""
    distance = float(np.linalg.norm(position))
    a = 1.0 / (2.0 / distance - velocity @ velocity / MU)
    root, along = np.sqrt(a), position @ velocity / np.sqrt(MU)
    rate = np.sqrt(MU / a**3)

    def change(angle: float) -> float:
        s, c = np.sin(angle), np.cos(angle)
        return float(angle + along / root * (1.0 - c) - (1.0 - distance / a) * s - rate * time)

    angle = brentq(change, rate * time - 2.0, rate * time + 2.0, xtol=1e-15, rtol=1e-15)
    s, c = np.sin(angle), np.cos(angle)
    f = 1.0 - a / distance * (1.0 - c)
    g = time - (angle - s) / rate
    return np.asarray(f * position + g * velocity)


@pytest.mark.parametrize("distance", [1.0, 1e5])
def test_a_free_robot_is_on_its_own_ellipse(distance: float) -> None:
    """Beside Kepler's equation for point and robot, whose difference is rounded to some 1e-8 m."""
    place, motion = (distance * np.array(values) for values in DIRECTIONS["any"])
    plant = orbiting_plant(rigid_robot(100.0, [20.0] * 3), PERIOD)
    set_motion(plant, position=place, velocity=N * motion)
    point, speed = plant.truth.orbit_position.copy(), plant.truth.orbit_velocity.copy()
    for _ in range(3):
        state = coast(plant, 3000)
        time = plant.tick * PERIOD
        of_point = kepler(point, speed, time)
        of_robot = kepler(point + place, speed + N * motion, time)
        np.testing.assert_allclose(state.orbit_position, of_point, rtol=0, atol=2e-7)
        np.testing.assert_allclose(state.base_position, of_robot - of_point, rtol=0, atol=2e-7)
