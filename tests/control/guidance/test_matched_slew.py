"""Slews from rate to rate: their ends, their derivatives, and those from rest to rest."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from space_robot_control.guidance.courses import Course, Slew, turn_between
from space_robot_control.guidance.matched_slew import MatchedSlew
from space_robot_control.guidance.pointing import PointingCourse, PointingGoal
from space_robot_model.orbit.ephemeris import AssumedOrbit, Ephemeris
from space_robot_msgs_py.errors import InputError

Array = NDArray[np.float64]

BEGIN, SPAN = 50.0, 60.0
IDENTITY = np.array([1.0, 0.0, 0.0, 0.0])
ORBIT = Ephemeris(
    AssumedOrbit.model_validate(
        {
            "orbital_elements": {"height": 420e3, "eccentricity": 0.01, "inclination_deg": 51.6},
            "target": {"name": "target", "position": [30.0, 100.0, 20.0]},
        }
    )
)
QUATERNION = (
    st.tuples(*[st.floats(-1.0, 1.0)] * 4)
    .filter(lambda q: np.linalg.norm(q) > 0.1)
    .map(lambda q: np.array(q) / np.linalg.norm(q))
)


def still(quaternion: Array) -> Slew:
    """Return the course that keeps an attitude."""
    return Slew(0.0, 1.0, quaternion, np.zeros(3), 0.0)


def pointing(point: str, offset_deg: list[float]) -> PointingCourse:
    """Return a course that points."""
    content = {"point": point, "offset_deg": offset_deg}
    return PointingCourse(PointingGoal.model_validate(content), ORBIT, 0.0, IDENTITY)


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


def rotations(rows: Array) -> Rotation:
    """Return the attitudes of rows (T, 10)."""
    return Rotation.from_quat(rows[:, [1, 2, 3, 0]])


def assert_same(actual: Array, expected: Array, atol: float) -> None:
    """Assert that rows are the same motion; a quaternion and its negative are one attitude."""
    signs = np.sign(np.sum(actual[:, :4] * expected[:, :4], axis=1))[:, np.newaxis]
    np.testing.assert_allclose(actual[:, :4] * signs, expected[:, :4], rtol=0, atol=atol)
    np.testing.assert_allclose(actual[:, 4:], expected[:, 4:], rtol=0, atol=atol)


PAIRS: list[tuple[Course, Course]] = [
    (pointing("nadir", [0.0, 0.0, 0.0]), pointing("target", [10.0, 20.0, 30.0])),
    (pointing("velocity", [170.0, -40.0, 0.0]), pointing("nadir", [0.0, 0.0, 90.0])),
    (still(np.array([0.5, -0.5, 0.5, 0.5])), pointing("nadir", [0.0, 0.0, 0.0])),
    (pointing("nadir", [0.0, 0.0, 0.0]), still(np.array([0.0, 0.6, 0.0, -0.8]))),
    (Spin(0.05, 0.001), pointing("nadir", [20.0, 0.0, 0.0])),
    (Spin(-0.03, 0.0), Spin(0.02, 0.0005)),
    (pointing("nadir", [0.0, 0.0, 0.0]), pointing("nadir", [0.0, 0.0, 1e-5])),
    (pointing("nadir", [0.0, 0.0, 0.0]), pointing("nadir", [0.0, 0.0, 0.0])),
]


@pytest.mark.parametrize(("before", "after"), PAIRS)
def test_the_base_leaves_one_course_and_is_on_the_other(before: Course, after: Course) -> None:
    slew = MatchedSlew(BEGIN, SPAN, before, after)
    early, late = np.array([BEGIN - 3.0, BEGIN]), BEGIN + SPAN + np.array([-1e-9, 0.0, 1e-9, 40.0])
    assert_same(slew.at(early), before.at(early), 1e-13)
    assert_same(slew.at(late), after.at(late), 1e-11)
    assert_same(slew.at(late[1:]), after.at(late[1:]), 1e-13)


@pytest.mark.parametrize(("before", "after"), PAIRS)
def test_rates_and_accelerations_are_the_attitudes_derivatives(
    before: Course, after: Course
) -> None:
    """By central differences, also across both ends; the quaternion does not jump."""
    slew, step = MatchedSlew(BEGIN, SPAN, before, after), 1e-3
    times = np.linspace(BEGIN - 2.0, BEGIN + SPAN + 2.0, 1501)
    rows, ahead, behind = (slew.at(times + k * step) for k in (0, 1, -1))
    turn = (rotations(behind).inv() * rotations(ahead)).as_rotvec() / (2.0 * step)
    np.testing.assert_allclose(turn, rows[:, 4:7], rtol=0, atol=1e-9)
    change = (ahead[:, 4:7] - behind[:, 4:7]) / (2.0 * step)
    is_inside = np.abs(np.abs(times - BEGIN - 0.5 * SPAN) - 0.5 * SPAN) > 2.0 * step
    np.testing.assert_allclose(change[is_inside], rows[is_inside, 7:], rtol=0, atol=1e-9)
    assert np.abs(np.diff(rows, axis=0)).max() < 0.02


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


def test_a_spin_comes_to_rest_at_an_attitude() -> None:
    goal = np.array([0.5, 0.5, -0.5, 0.5])
    slew = MatchedSlew(BEGIN, 20.0, Spin(0.1, 0.01), still(goal))
    assert_same(slew.at(np.array([BEGIN])), Spin(0.1, 0.01).at(np.array([BEGIN])), 1e-14)
    last = slew.at(np.array([BEGIN + 20.0, BEGIN + 100.0]))
    assert_same(last, still(goal).at(np.zeros(2)), 1e-14)


def test_chunks_are_the_same_to_the_bit() -> None:
    slew, times = MatchedSlew(BEGIN, SPAN, *PAIRS[0]), BEGIN + np.arange(-10.0, 80.0, 0.25)
    parts = [slew.at(part) for part in np.array_split(times, 17)]
    np.testing.assert_array_equal(np.concatenate(parts), slew.at(times))


def test_a_slew_that_would_turn_once_round_is_refused() -> None:
    line = "in 200 s the base would turn once round on its way, for it moves at 17.2 degrees/s"
    with pytest.raises(InputError, match=line):
        MatchedSlew(BEGIN, 200.0, Spin(0.3, 0.0), still(IDENTITY))
