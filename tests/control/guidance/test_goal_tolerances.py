"""Tolerances of goals: read, and measured along a trajectory and after its end."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from space_robot_control.guidance.courses import Piece, QuinticLeg, Slew
from space_robot_control.guidance.goal_tolerances import GoalTolerances
from space_robot_msgs_py.errors import InputError

NAMES = ("shoulder", "elbow")
BEGIN, END = 1.0, 3.0
LEG = QuinticLeg(BEGIN, END - BEGIN, np.zeros(2), np.array([0.5, -0.5]))
STILL = Slew(BEGIN, 1.0, np.array([1.0, 0.0, 0.0, 0.0]), np.zeros(3), 0.0)
PIECE = Piece(BEGIN, END, LEG, STILL, LEG.rise, STILL.quaternion)
TIME = np.linspace(0.5, 5.0, 451)


def tolerances(seconds: float = 0.0, **entries: Any) -> GoalTolerances:
    """Of a goal, by ``path`` and ``goal``: name, position, velocity."""
    lists = {
        f"{kind}_tolerance": [
            SimpleNamespace(name=name, position=position, velocity=velocity)
            for name, position, velocity in entries.get(kind, ())
        ]
        for kind in ("path", "goal")
    }
    nanoseconds = round(seconds * 1e9)
    duration = SimpleNamespace(sec=nanoseconds // 10**9, nanosec=nanoseconds % 10**9)
    return GoalTolerances.read(SimpleNamespace(goal_time_tolerance=duration, **lists), NAMES)


def flown(error: np.ndarray) -> np.ndarray:
    """The joints as measured, with the errors (T,) of the elbow's position."""
    states = LEG.at(TIME)[:, :2].copy()
    states[:, 0, 1] += error
    return states


def verdict(limits: GoalTolerances, error: np.ndarray) -> tuple[str, str] | None:
    """As told by all states at once, or by one after the other."""
    states = flown(error)
    together = limits.judge(PIECE, NAMES, TIME, states)
    single = (limits.judge(PIECE, NAMES, TIME[k : k + 1], states[k : k + 1]) for k in range(451))
    assert together == next(filter(None, single), None)
    return together


def test_without_numbers_nothing_is_limited() -> None:
    assert not tolerances().are_given
    assert not tolerances(path=[("elbow", 0.0, -1.0)], goal=[("elbow", -1.0, 0.0)]).are_given
    assert tolerances().time == np.inf


def test_an_error_on_the_way_is_found_at_its_time() -> None:
    error = np.where((TIME > 1.995) & (TIME < 2.5), 0.02, 0.001)
    limits = tolerances(path=[("elbow", 0.01, 0.0)])
    code, text = verdict(limits, error)
    assert code == "PATH_TOLERANCE_VIOLATED"
    assert text == (
        "the position of joint 'elbow' is off by 0.02 at t = 2.0000 s, path_tolerance is 0.01"
    )
    assert verdict(tolerances(path=[("shoulder", 0.01, 0.0)]), error) == ("SUCCESSFUL", "")


def test_before_the_begin_nothing_is_looked_at() -> None:
    error = np.where(TIME < BEGIN - 0.005, 1.0, 0.0)
    assert verdict(tolerances(path=[("elbow", 0.01, 0.0)]), error) == ("SUCCESSFUL", "")


def test_the_goal_is_reached_when_the_joints_are_within_its_tolerances() -> None:
    error = np.where(TIME < 4.0, 0.02, 0.0)
    goal = [("elbow", 0.01, 0.0)]
    assert verdict(tolerances(1.5, goal=goal), error) == ("SUCCESSFUL", "")
    assert verdict(tolerances(goal=goal), error) == ("SUCCESSFUL", "")  # 0: as long as it takes
    code, text = verdict(tolerances(0.5, goal=goal), error)
    assert code == "GOAL_TOLERANCE_VIOLATED"
    assert text.startswith("the position of joint 'elbow' is off by 0.02 at t = 3.51")
    assert text.endswith("goal_tolerance is 0.01")
    assert verdict(tolerances(goal=goal), np.full(451, 0.02)) is None


def test_a_state_that_is_not_known_is_not_at_the_goal() -> None:
    limits = tolerances(0.5, path=[("elbow", 0.01, 0.0)], goal=[("elbow", 0.01, 0.0)])
    code, text = verdict(limits, np.full(451, np.nan))
    assert (code, "elbow' is off by nan" in text) == ("GOAL_TOLERANCE_VIOLATED", True)


def test_rates_are_measured_too() -> None:
    limits, states = tolerances(path=[("shoulder", 0.0, 0.1)]), flown(np.zeros(451))
    assert limits.judge(PIECE, NAMES, TIME, states) == ("SUCCESSFUL", "")
    states[200, 1, 0] += 0.2
    told = limits.judge(PIECE, NAMES, TIME, states)
    assert told is not None
    assert "the velocity of joint 'shoulder' is off by 0.2" in told.text


@pytest.mark.parametrize(
    ("entry", "said"),
    [
        (("wrist", 0.1, 0.0), "unknown joint 'wrist' of path_tolerance"),
        (("elbow", -0.5, 0.0), "position of joint 'elbow': a number above 0 was expected, or 0 or"),
        (("elbow", 0.0, np.nan), "velocity of joint 'elbow': .* got nan"),
    ],
)
def test_wrong_tolerances_are_refused_in_one_line(entry: Any, said: str) -> None:
    with pytest.raises(InputError, match=said) as caught:
        tolerances(path=[entry])
    assert "\n" not in str(caught.value)
