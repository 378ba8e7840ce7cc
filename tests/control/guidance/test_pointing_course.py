"""Pointing against SciPy's rotations: attitudes, rates, accelerations, what is refused."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike, NDArray
from orbiting_robots import EARTH_RADIUS, MU
from scipy.integrate import solve_ivp
from scipy.spatial.transform import Rotation

from space_robot_control.guidance.pointing import PointingCourse, PointingGoal
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ISS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 200.0}
GTO = {"height": 18e6, "eccentricity": 0.72, "inclination_deg": 7.0, "anomaly_deg": -10.0}
TARGET = {"name": "target", "position": [30.0, -50.0, 20.0], "velocity": [0.01, 0.03, -0.02]}
MEAN_MOTION = float(np.sqrt(MU / (EARTH_RADIUS + ISS["height"]) ** 3))
AXIS = st.tuples(*[st.floats(-1.0, 1.0)] * 3).map(list).filter(lambda a: np.linalg.norm(a) > 0.1)
ANGLE = st.floats(-180.0, 180.0)
PAIRS = [
    ("nadir", "velocity"),
    ("nadir", "sun"),
    ("nadir", "target"),
    ("nadir", [1.0, 2.0, -3.0]),
    ("velocity", "normal"),
    ("velocity", None),
    ("sun", "nadir"),
    ("sun", None),
    ("target", "nadir"),
    ("target", None),
    ("inertial", "velocity"),
    ("inertial", None),
]


def orbit(**assumed: Any) -> Ephemeris:
    """Return an ephemeris, by default with a station's orbit, a target, and a high Sun."""
    content = {"orbital_elements": ISS, "target": TARGET, "beta_angle_deg": 50.0}
    return Ephemeris(AssumedOrbit.model_validate(content | assumed))


def goal(**keys: Any) -> PointingGoal:
    """Return a goal as a segment has it."""
    if keys["point"] == "inertial":
        keys.setdefault("direction", [0.5, 0.4, -0.1])
    return validate(PointingGoal, keys, "base")


def course(known: Ephemeris | None, begin: float = 0.0, **keys: Any) -> PointingCourse:
    """Return the course of such a goal."""
    return PointingCourse(goal(**keys), known, begin, IDENTITY)


def rotations(rows: Array) -> Rotation:
    """Return the attitudes of rows (T, 10)."""
    return Rotation.from_quat(rows[:, [1, 2, 3, 0]])


def direction(known: Ephemeris, name: str | list[float], time: float) -> Array:
    """Return a direction (3,), inertial axes."""
    motion = known.motion(np.array([time]))
    r, v = motion.position[0], motion.velocity[0]
    target = known.target_motion(np.array([time])).position[0]
    named = {"nadir": -r, "velocity": v, "normal": np.cross(r, v), "sun": known.sun}
    named["target"] = target
    return named[name] if isinstance(name, str) else np.array(name)


def triad(first: ArrayLike, second: ArrayLike) -> Array:
    """Return axes as columns: along the first, in the plane of both, across."""
    a, across = np.asarray(first), np.cross(first, second)
    a, across = a / np.linalg.norm(a), across / np.linalg.norm(across)
    return np.column_stack([a, np.cross(across, a), across])


@settings(max_examples=100, deadline=None)
@given(st.sampled_from(PAIRS), AXIS, AXIS, st.tuples(ANGLE, ANGLE, ANGLE), st.floats(0.0, 9e3))
def test_attitudes_are_those_of_two_directions(
    pair: tuple[str, Any], axis: list[float], about_axis: list[float], offset: Any, time: float
) -> None:
    """``axis`` points, ``about_axis`` is in the half plane of the second direction."""
    point, about = pair
    a, b = (np.array(v) / np.linalg.norm(v) for v in (axis, about_axis))
    if np.linalg.norm(np.cross(a, b)) < 0.1:
        return
    known = orbit()
    pointing = course(
        known, point=point, about=about, axis=axis, about_axis=about_axis, offset_deg=list(offset)
    )
    row = pointing.at(np.array([time]))
    first = direction(known, [0.5, 0.4, -0.1] if point == "inertial" else point, time)
    usual = {"velocity": "nadir", "target": "normal"}.get(point, [0.0, 0.0, 1.0])
    second = direction(known, about or usual, time)
    if about is None and point == "sun" and abs(known.sun[2]) > np.sqrt(0.5):
        second = np.array([1.0, 0.0, 0.0])
    if np.linalg.norm(np.cross(first, second)) < 0.1 * np.prod(
        [np.linalg.norm(v) for v in (first, second)]
    ):
        return
    turn = Rotation.from_euler("xyz", offset, degrees=True)
    expected = Rotation.from_matrix(triad(first, second) @ triad(a, b).T) * turn
    assert np.linalg.norm(row[0, :4]) == pytest.approx(1.0, abs=1e-15)
    wanted = np.roll(expected.as_quat(), 1)
    wanted = wanted if wanted @ row[0, :4] > 0.0 else -wanted
    np.testing.assert_allclose(row[0, :4], wanted, rtol=0, atol=1e-14)
    directions = [v / np.linalg.norm(v) for v in (first, second)]
    aligned, _ = Rotation.align_vectors(directions, [a, b], weights=[np.inf, 1.0])
    assert (rotations(row)[0] * turn.inv() * aligned.inv()).magnitude() < 1e-7


def test_nadir_on_a_circular_orbit_turns_with_the_mean_motion() -> None:
    """About the normal, at a constant rate; z points down and x ahead, so -y is the normal."""
    known = orbit(j2=False)
    rows = course(known, point="nadir").at(np.linspace(0.0, 5560.0, 5001))
    np.testing.assert_allclose(rows[:, 5], -MEAN_MOTION, rtol=1e-12)
    np.testing.assert_allclose(rows[:, [4, 6]], 0.0, rtol=0, atol=1e-12 * MEAN_MOTION)
    np.testing.assert_allclose(rows[:, 7:], 0.0, rtol=0, atol=1e-15)


@pytest.mark.parametrize("elements", [ISS, GTO])
@pytest.mark.parametrize(("point", "about"), PAIRS)
def test_rates_and_accelerations_are_the_attitudes_derivatives(
    elements: dict[str, float], point: str, about: Any
) -> None:
    """By central differences of rotations and of rates; with J2."""
    pointing = course(
        orbit(orbital_elements=elements),
        begin=3.0,
        point=point,
        about=about,
        axis=[1.0, 2.0, 3.0],
        offset_deg=[10.0, 20.0, 30.0],
    )
    times, step = np.linspace(4.0, 3000.0, 400), 0.02
    rows, ahead, behind = (pointing.at(times + k * step) for k in (0, 1, -1))
    turn = (rotations(behind).inv() * rotations(ahead)).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(turn, rows[:, 4:7], rtol=0, atol=1e-8)
    change = (ahead[:, 4:7] - behind[:, 4:7]) / (2.0 * step)
    np.testing.assert_allclose(change, rows[:, 7:], rtol=1e-6, atol=1e-10)


def test_rates_lead_to_the_attitude_along_an_eccentric_orbit() -> None:
    pointing = course(orbit(orbital_elements=GTO), point="nadir", offset_deg=[5.0, 10.0, -20.0])
    end = 6000.0

    def derivative(time: float, q: Array) -> Array:
        w = pointing.at(np.array([time]))[0, 4:7]
        turn = Rotation.from_quat(q, scalar_first=False).as_quat()
        x, y, z, s = turn
        rate = [s * w[0] + y * w[2] - z * w[1], s * w[1] + z * w[0] - x * w[2]]
        rate += [s * w[2] + x * w[1] - y * w[0], -x * w[0] - y * w[1] - z * w[2]]
        return 0.5 * np.array(rate)

    first, last = rotations(pointing.at(np.array([0.0, end])))
    flown = solve_ivp(derivative, (0.0, end), first.as_quat(), rtol=1e-11, atol=1e-13)
    assert (Rotation.from_quat(flown.y[:, -1]).inv() * last).magnitude() < 1e-8


def test_quaternions_do_not_jump_and_do_not_depend_on_how_they_are_asked_for() -> None:
    known, times = orbit(), np.arange(100.0, 17_000.0, 2.0)
    keys: dict[str, Any] = {"point": "nadir", "axis": [1.0, 0.3, 0.2], "about": "target"}
    whole = course(known, begin=100.0, **keys).at(times)
    assert np.abs(np.diff(whole[:, :4], axis=0)).max() < 0.1
    assert rotations(whole).magnitude().max() > 3.0
    parts = course(known, begin=100.0, **keys)
    for first, last in ((0, 1), (5000, 5003), (1, 5000), (5003, len(times))):
        np.testing.assert_array_equal(parts.at(times[first:last]), whole[first:last])


def test_the_first_quaternion_is_in_the_hemisphere_of_the_one_before() -> None:
    known = orbit()
    wanted = goal(point="nadir", offset_deg=[40.0, 0.0, 0.0])
    for near in (IDENTITY, -IDENTITY):
        pointing = PointingCourse(wanted, known, 7.0, near)
        assert pointing.at(np.array([7.0]))[0, :4] @ near > 0.0


def test_a_fixed_direction_needs_no_orbit_and_does_not_turn() -> None:
    pointing = course(None, point="inertial", direction=[0.0, 3.0, 0.0], axis=[1.0, 0.0, 0.0])
    pointing.check(0.0, 1e5)
    rows = pointing.at(np.array([0.0, 10.0]))
    np.testing.assert_allclose(rotations(rows).apply([1.0, 0.0, 0.0]), [[0.0, 1.0, 0.0]] * 2)
    np.testing.assert_array_equal(rows[:, 4:], 0.0)


def test_the_sun_is_pointed_at_also_in_eclipse() -> None:
    known = orbit(beta_angle_deg=0.0)
    rows = course(known, point="sun", axis=[0.0, 1.0, 0.0]).at(np.linspace(0.0, 5560.0, 50))
    expected = np.broadcast_to(known.sun, (50, 3))
    np.testing.assert_allclose(rotations(rows).apply([0.0, 1.0, 0.0]), expected, atol=1e-15)


@pytest.mark.parametrize(
    ("keys", "text"),
    [
        ({"point": "nadir", "about": "nadir"}, "about: nadir is the direction that the axis"),
        ({"point": "nadir", "about": "up"}, "about: choose one of velocity, .* or a direction"),
        ({"point": "inertial", "direction": None}, "point: inertial needs direction"),
        ({"point": "sun", "direction": [1.0, 0.0, 0.0]}, "direction is for point: inertial"),
        ({"point": "sun", "axis": [0.0, 0.0, 0.0]}, "axis must have a norm of"),
        ({"point": "sun", "about": [0.0, 0.0, 0.0]}, "about must have a norm of"),
        (
            {"point": "sun", "axis": [0.0, 0.0, 1.0], "about_axis": [0.0, 0.001, -2.0]},
            r"axis \[0.0, 0.0, 1.0\] and about_axis \[0.0, 0.001, -2.0\] are parallel",
        ),
        (
            {"point": "inertial", "direction": [1.0, 0.0, 0.0], "about": [-2.0, 0.01, 0.0]},
            "direction .* and about .* are parallel to 0.29 degrees",
        ),
        ({"point": "zenith"}, "point: Input should be 'nadir', 'velocity', 'sun'"),
        ({"point": "nadir", "about": [1.0, 0.0]}, "base: about"),
    ],
)
def test_a_wrong_goal_is_refused_in_one_line(keys: dict[str, Any], text: str) -> None:
    with pytest.raises(InputError, match=text) as error:
        goal(**keys)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("keys", "key"),
    [
        ({"point": "nadir"}, "point: nadir"),
        ({"point": "sun"}, "point: sun"),
        ({"point": "inertial", "about": "velocity"}, "about: velocity"),
    ],
)
def test_what_needs_an_orbit_is_refused_without_one(keys: dict[str, Any], key: str) -> None:
    with pytest.raises(InputError, match=f"base.{key} needs an orbit"):
        course(None, **keys)


@pytest.mark.parametrize("keys", [{"point": "target"}, {"point": "nadir", "about": "target"}])
def test_a_target_that_is_not_known_is_refused(keys: dict[str, Any]) -> None:
    with pytest.raises(InputError, match="target: flight software knows of no target"):
        course(orbit(target={}), **keys)


def test_directions_that_meet_on_the_way_are_refused() -> None:
    """Noon is a quarter of an orbit ahead of the node."""
    elements = {"height": 420e3, "inclination_deg": 51.6}
    known = orbit(orbital_elements=elements, j2=False, beta_angle_deg=0.0, noon_deg=90.0)
    pointing = course(known, point="nadir", about="sun")
    quarter = 0.5 * np.pi / np.sqrt(MU / (EARTH_RADIUS + 420e3) ** 3)
    pointing.check(0.0, quarter - 20.0)
    pointing.check(quarter + 20.0, 3.0 * quarter - 20.0)
    line = r"base.about: 'sun' is 0.\d+ degrees from the line of nadir at t = 13\d\d"
    with pytest.raises(InputError, match=line):
        pointing.check(0.0, 2.0 * quarter)
    course(orbit(beta_angle_deg=1.5), point="nadir", about="sun").check(0.0, 5560.0)


def test_the_default_second_direction_of_a_sun_above_the_pole_is_another_one() -> None:
    elements = {"height": 420e3, "inclination_deg": 0.0}
    known = orbit(orbital_elements=elements, beta_angle_deg=90.0)
    course(known, point="sun").check(0.0, 5560.0)
    with pytest.raises(InputError, match=r"'normal' is .* degrees from the line of sun"):
        course(known, point="sun", about="normal").check(0.0, 5560.0)


def test_a_target_at_the_robot_is_refused() -> None:
    known = orbit(target={"name": "near", "position": [10.0, 0.0, 0.0], "velocity": [-0.1, 0, 0]})
    pointing = course(known, point="target")
    pointing.check(0.0, 50.0)
    with pytest.raises(InputError, match=r"base.point: target is 0.0\d+ m from .* at t = "):
        pointing.check(0.0, 300.0)
