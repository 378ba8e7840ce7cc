"""Missions against the limits of a robot's joints: refused, or remarked upon."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import DATA

from space_robot.tuning.warning import limit_remarks
from space_robot_control.guidance.limits import too_fast, too_strong
from space_robot_control.guidance.mission import Mission, MissionSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError

ROBOT = Robot.from_yaml(DATA / "passive_robot" / "robot.yaml")
"""A shoulder of 120 degrees and 30 degrees/s, a boom of 1.5 m and 0.4 m/s, a free wrist."""


def mission(end: list[float], times: tuple[float, float] = (0.0, 10.0)) -> MissionSettings:
    return MissionSettings(
        waypoint_times=list(times), waypoints_deg=[0.0, 0.2, *[0.0] * 4, *end, *[0.0] * 3]
    )


@pytest.mark.parametrize(
    ("end", "said"),
    [
        ([120.1, 0.2, 0.0], "'shoulder' at 120.1 degrees, its limits are -120 to 120 degrees"),
        ([-150.0, 0.2, 0.0], "'shoulder' at -150 degrees, its limits are -120 to 120 degrees"),
        ([0.0, 1.6, 0.0], "'boom' at 1.6 m, its limits are 0 to 1.5 m"),
        ([0.0, -0.1, 0.0], "'boom' at -0.1 m, its limits are 0 to 1.5 m"),
    ],
)
def test_a_waypoint_beyond_a_limit_is_refused_in_one_line(end: list[float], said: str) -> None:
    with pytest.raises(InputError, match=r"^waypoints_deg: waypoint 2 has joint ") as error:
        Mission(ROBOT, mission(end), 0.01)
    assert str(error.value).endswith(said)
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("end", [[120.0, 1.5, 900.0], [-120.0, 0.0, 0.0]])
def test_limits_themselves_and_joints_without_any_are_allowed(end: list[float]) -> None:
    Mission(ROBOT, mission(end), 0.01)


@given(st.floats(0.5, 20.0), st.floats(-120.0, 120.0), st.floats(0.0, 1.5))
def test_too_fast_is_what_the_reference_is(span: float, shoulder: float, boom: float) -> None:
    """The largest velocity is that of the reference, sampled halfway too."""
    planned = Mission(ROBOT, mission([shoulder, boom, 50.0], (0.0, span)), span / 200.0)
    largest = np.abs(planned.chunk(0, 201).joints[:, 1]).max(axis=0)
    found = {b.joint: b for b in too_fast(ROBOT, planned.times, planned.waypoints)}
    for j, name in enumerate(ROBOT.joint_names):
        limit = ROBOT.limits[j].velocity
        if abs(largest[j] / limit - 1.0) > 1e-6:
            assert (name in found) == (largest[j] > limit)
        if name in found:
            assert found[name].asked == pytest.approx(largest[j], rel=1e-9)
            assert found[name].unit == ("m/s" if name == "boom" else "rad/s")


def test_forces_are_held_against_efforts() -> None:
    found = too_strong(ROBOT, np.array([[39.0, -21.0, *[1e9] * 4], [-39.5, 3.0, *[0.0] * 4]]))
    assert [(b.joint, b.asked, b.limit, b.unit) for b in found] == [("boom", 21.0, 20.0, "N")]


def test_remarks_name_joint_number_and_unit() -> None:
    """A mission of 8 s is within the limits; in one of 0.5 s all is too much."""
    assert not limit_remarks(ROBOT, mission([30.0, 0.8, -10.0], (0.0, 8.0)))
    said = limit_remarks(ROBOT, mission([60.0, 1.4, -10.0], (0.0, 0.5)))
    assert [tuple(line.split(" ")[2:4]) for line in said] == [
        ("shoulder", "would"),
        ("boom", "would"),
        ("shoulder", "needs"),
        ("boom", "needs"),
    ]
    assert said[1] == "warning: mission: boom would move at 4.5 m/s, its limit is 0.4 m/s"
    assert said[3].endswith("N and more, its limit is 20 N")


def test_a_single_waypoint_asks_for_nothing() -> None:
    held = MissionSettings(waypoint_times=[0.0], waypoints_deg=[0.0, 0.2, *[0.0] * 4])
    assert not limit_remarks(ROBOT, held)
