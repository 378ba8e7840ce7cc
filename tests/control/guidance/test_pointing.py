"""Courses that point and slews between courses, against SciPy's rotations."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import ArrayLike
from oracles.orbit import EARTH_RADIUS, MU
from scipy.spatial.transform import Rotation

from space_robot_control.guidance.courses import Course, Slew, turn_between
from space_robot_control.guidance.goals import PointingGoal
from space_robot_control.guidance.matched_slew import MatchedSlew
from space_robot_control.guidance.pointing import PointingCourse
from space_robot_model.elementary.matrices import Array
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_msgs_py.config.validation import validate
from space_robot_msgs_py.errors import InputError

IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ISS = {"height": 420e3, "inclination_deg": 51.6, "raan_deg": 30.0, "anomaly_deg": 200.0}
GTO = {"height": 18e6, "eccentricity": 0.72, "inclination_deg": 7.0, "anomaly_deg": -10.0}
TARGET = {"name": "target", "position": [30.0, -50.0, 20.0], "velocity": [0.01, 0.03, -0.02]}
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


def course(known: Ephemeris | None, begin: float = 0.0, **keys: Any) -> PointingCourse:
    """The course of a goal as a segment has it."""
    if keys["point"] == "inertial":
        keys.setdefault("direction", [0.5, 0.4, -0.1])
    near = keys.pop("near", IDENTITY)
    return PointingCourse(validate(PointingGoal, keys, "base"), known, begin, near)


def rotations(rows: Array) -> Rotation:
    """Attitudes of rows (T, 10)."""
    return Rotation.from_quat(rows[:, :4], scalar_first=True)


def assert_derivatives(course: Course, times: Array, step: float, tolerances: Any) -> Array:
    """Rates are those of the attitudes, accelerations those of the rates: central differences."""
    rows, ahead, behind = (course.at(times + k * step) for k in (0, 1, -1))
    turn = (rotations(behind).inv() * rotations(ahead)).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(turn, rows[:, 4:7], rtol=0, atol=tolerances[0])
    change = (ahead[:, 4:7] - behind[:, 4:7]) / (2.0 * step)
    np.testing.assert_allclose(change, rows[:, 7:], rtol=1e-6, atol=tolerances[1])
    return rows


def direction(known: Ephemeris, name: str | list[float], time: float) -> Array:
    """Return a direction (3,), inertial axes."""
    motion = known.motion(np.array([time]))
    r, v = motion.position[0], motion.velocity[0]
    target = known.motion(np.array([time]), of_target=True).position[0]
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


@pytest.mark.parametrize("elements", [ISS, GTO])
@pytest.mark.parametrize(("point", "about"), PAIRS)
def test_rates_and_accelerations_are_the_attitudes_derivatives(
    elements: dict[str, float], point: str, about: Any
) -> None:
    """With J2."""
    keys: dict[str, Any] = {"axis": [1.0, 2.0, 3.0], "offset_deg": [10.0, 20.0, 30.0]}
    pointing = course(orbit(orbital_elements=elements), 3.0, point=point, about=about, **keys)
    assert_derivatives(pointing, np.linspace(4.0, 3000.0, 200), 0.02, (1e-8, 1e-10))


def test_quaternions_do_not_jump_and_do_not_depend_on_how_they_are_asked_for() -> None:
    known, times = orbit(), np.arange(100.0, 6_000.0, 2.0)
    keys: dict[str, Any] = {"point": "nadir", "axis": [1.0, 0.3, 0.2], "about": "target"}
    whole = course(known, begin=100.0, **keys).at(times)
    assert np.abs(np.diff(whole[:, :4], axis=0)).max() < 0.1
    assert rotations(whole).magnitude().max() > 3.0
    parts = course(known, begin=100.0, **keys)
    for first, last in ((0, 1), (1000, 1003), (1, 1000), (1003, len(times))):
        np.testing.assert_array_equal(parts.at(times[first:last]), whole[first:last])


def test_the_first_quaternion_is_in_the_hemisphere_of_the_one_before() -> None:
    for near in (IDENTITY, -IDENTITY):
        pointing = course(orbit(), 7.0, point="nadir", offset_deg=[40.0, 0.0, 0.0], near=near)
        assert pointing.at(np.array([7.0]))[0, :4] @ near > 0.0


def test_a_fixed_direction_needs_no_orbit_and_does_not_turn() -> None:
    pointing = course(None, point="inertial", direction=[0.0, 3.0, 0.0], axis=[1.0, 0.0, 0.0])
    pointing.check(0.0, 1e5)
    rows = pointing.at(np.array([0.0, 10.0]))
    np.testing.assert_allclose(rotations(rows).apply([1.0, 0.0, 0.0]), [[0.0, 1.0, 0.0]] * 2)
    np.testing.assert_array_equal(rows[:, 4:], 0.0)


def test_directions_that_meet_on_the_way_are_refused() -> None:
    """Noon is a quarter of an orbit ahead of the node. A Sun above the pole has another default."""
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
    known = orbit(orbital_elements=elements | {"inclination_deg": 0.0}, beta_angle_deg=90.0)
    course(known, point="sun").check(0.0, 5560.0)
    with pytest.raises(InputError, match=r"'normal' is .* degrees from the line of sun"):
        course(known, point="sun", about="normal").check(0.0, 5560.0)


def test_a_target_at_the_robot_is_refused() -> None:
    known = orbit(target={"name": "near", "position": [10.0, 0.0, 0.0], "velocity": [-0.1, 0, 0]})
    pointing = course(known, point="target")
    pointing.check(0.0, 50.0)
    with pytest.raises(InputError, match=r"base.point: target is 0.0\d+ m from .* at t = "):
        pointing.check(0.0, 300.0)


# Slews from course to course


BEGIN, SPAN = 50.0, 60.0
QUATERNION = (
    st.tuples(*[st.floats(-1.0, 1.0)] * 4)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: np.array(q) / np.linalg.norm(q))
)


def still(quaternion: Array) -> Slew:
    """Return the course that keeps an attitude."""
    return Slew(0.0, 1.0, quaternion, np.zeros(3), 0.0)


class Spin:
    """A turn about a fixed axis that is accelerated."""

    def __init__(self, rate: float, acceleration: float) -> None:
        self.rate, self.acceleration = rate, acceleration
        self.axis = np.array([0.6, 0.0, 0.8])

    def at(self, time: Array) -> Array:
        """Return (T, 10)."""
        since = time - BEGIN
        angle = self.rate * since + 0.5 * self.acceleration * since**2
        turns = Rotation.from_rotvec(angle[:, np.newaxis] * self.axis).as_quat()
        rates = (self.rate + self.acceleration * since)[:, np.newaxis] * self.axis
        accelerations = np.broadcast_to(self.acceleration * self.axis, rates.shape)
        return np.column_stack([np.roll(turns, 1, axis=1), rates, accelerations])


def assert_same(actual: Array, expected: Array, atol: float) -> None:
    """Assert that rows are the same motion; a quaternion and its negative are one attitude."""
    signs = np.sign(np.sum(actual[:, :4] * expected[:, :4], axis=1))[:, np.newaxis]
    np.testing.assert_allclose(actual[:, :4] * signs, expected[:, :4], rtol=0, atol=atol)
    np.testing.assert_allclose(actual[:, 4:], expected[:, 4:], rtol=0, atol=atol)


KNOWN = orbit(target={"name": "target", "position": [30.0, 100.0, 20.0]})
NADIR = course(KNOWN, point="nadir")
COURSES: list[tuple[Course, Course]] = [
    (NADIR, course(KNOWN, point="target", offset_deg=[10.0, 20.0, 30.0])),
    (course(KNOWN, point="velocity", offset_deg=[170.0, -40.0, 0.0]), NADIR),
    (still(np.array([0.5, -0.5, 0.5, 0.5])), NADIR),
    (NADIR, still(np.array([0.0, 0.6, 0.0, -0.8]))),
    (Spin(0.05, 0.001), course(KNOWN, point="nadir", offset_deg=[20.0, 0.0, 0.0])),
    (Spin(-0.03, 0.0), Spin(0.02, 0.0005)),
    (NADIR, course(KNOWN, point="nadir", offset_deg=[0.0, 0.0, 1e-5])),
    (NADIR, NADIR),
]


@pytest.mark.parametrize(("before", "after"), COURSES)
def test_a_slew_leaves_one_course_and_ends_on_the_other(before: Course, after: Course) -> None:
    """Its quaternion does not jump, also across both ends; chunks have the same bits."""
    slew = MatchedSlew(BEGIN, SPAN, before, after)
    early, late = np.array([BEGIN - 3.0, BEGIN]), BEGIN + SPAN + np.array([-1e-9, 0.0, 1e-9, 40.0])
    assert_same(slew.at(early), before.at(early), 1e-13)
    assert_same(slew.at(late), after.at(late), 1e-11)
    assert_same(slew.at(late[1:]), after.at(late[1:]), 1e-13)
    times = BEGIN + np.linspace(0.01, SPAN - 0.01, 1001)
    assert_derivatives(slew, times, 1e-3, (1e-9, 1e-9))
    times = np.linspace(BEGIN - 2.0, BEGIN + SPAN + 2.0, 1501)
    rows = slew.at(times)
    assert np.abs(np.diff(rows, axis=0)).max() < 0.02
    parts = [slew.at(part) for part in np.array_split(times, 17)]
    np.testing.assert_array_equal(np.concatenate(parts), rows)


@settings(max_examples=60, deadline=None)
@given(QUATERNION, QUATERNION, st.floats(5.0, 500.0))
def test_from_rest_to_rest_it_is_a_slew(first: Array, last: Array, span: float) -> None:
    axis, angle = turn_between(first, last)
    if angle > 3.1415:
        return  # either way is the shortest one
    times = BEGIN + np.linspace(-1.0, span + 1.0, 50)
    expected = Slew(BEGIN, span, first, axis, angle).at(times)
    matched = MatchedSlew(BEGIN, span, still(first), still(last)).at(times)
    np.testing.assert_allclose(matched, expected, rtol=0, atol=1e-14 * max(1.0, angle / span**2))


def test_a_slew_that_would_turn_once_round_is_refused() -> None:
    line = "in 200 s the base would turn once round on its way, for it moves at 17.2 degrees/s"
    with pytest.raises(InputError, match=line):
        MatchedSlew(BEGIN, 200.0, Spin(0.3, 0.0), still(IDENTITY))
