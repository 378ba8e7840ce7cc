"""A start away from the mission's: told before the flight and after it, with two torques."""

from __future__ import annotations

import json
import math
import warnings
from typing import Any

import numpy as np
import pytest
from command import Run
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from space_robot import Scenario
from space_robot.flight.start_step import sentence
from space_robot_model.robot.dynamics import inverse_dynamics
from space_robot_model.robot.find import find_robot

JOINTS = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]


def scenario(quaternion: Any = None, joints: Any = None, **options: Any) -> Scenario:
    plant = {} if quaternion is None else {"initial_quaternion": list(quaternion)}
    plant |= {} if joints is None else {"initial_joints_deg": list(joints)}
    return Scenario(
        **{"controller": "ctc", "duration": 0.2, "parameters": {"plant": plant}, **options}
    )


@settings(max_examples=4, deadline=None)
@given(st.lists(st.floats(-1.0, 1.0), min_size=3, max_size=3), st.integers(0, 5))
def test_places_and_torques_are_those_of_the_flight(vector: list[float], joint: int) -> None:
    """The angle is SciPy's; the demand is what the flight commands; the sign of q counts not."""
    turn = Rotation.from_rotvec(vector)
    x, y, z, w = turn.as_quat()
    joints = [*JOINTS[:joint], JOINTS[joint] + 5.0, *JOINTS[joint + 1 :]]
    flown = scenario(-np.array([w, x, y, z]), joints)
    with pytest.warns(UserWarning, match="^start: "):
        flight = flown.fly()
    step = flight.metrics["start_step"]
    assert step["attitude_deg"] == pytest.approx(math.degrees(turn.magnitude()), abs=1e-4)
    assert (step["joint"], step["unit"]) == (f"joint{joint + 1}", "rad")
    assert step["joint_error"] == pytest.approx(math.radians(5.0))
    commanded = flight.log.commanded_torque
    assert commanded is not None
    axis = flight.flight.robot.axis_names.index(step["axis"])
    assert step["demand"] == np.abs(commanded[:200, axis]).max()
    assert step["demand"] == np.abs(commanded[:200]).max()


def test_a_rate_that_the_law_has_to_brake_is_told() -> None:
    """Not one with which the first segment begins."""
    start = {"joints_deg": JOINTS, "base": {"rate_deg_s": [0, 3.0, 4.0]}}
    braked, led = (
        Scenario(controller="ctc", duration=0.2, mission={"start": start, "segments": [segment]})
        for segment in ({"hold": 5}, {"base": {"rpy_deg": [0, 0, 0]}, "duration": 60})
    )
    step = braked.check().start_step
    assert step
    assert step["rate_deg_s"] == pytest.approx(5.0)
    assert "the base's rate is 5 deg/s from where the mission begins" in sentence(step)
    assert led.check().start_step is None


def test_the_plausible_torque_is_the_missions_own() -> None:
    flight = scenario(joints=[*JOINTS[:5], 5.0], friction=False, duration=30.0).check()
    step = flight.start_step
    assert step
    references = flight.mission.chunk(0, 60_000).references()
    torque = np.abs(inverse_dynamics(find_robot("paper"), references)).max(axis=0)
    axis = flight.robot.axis_names.index(step["axis"])
    torque[:3] = torque[:3].max()  # the base may be turned about any axis
    assert step["planned"] == pytest.approx(torque[axis], rel=0.02)
    assert step["demand"] > 100.0 * step["planned"]


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"quaternion": [-1.0, 0.0, 0.0, 0.0]},
        {"quaternion": [2.0, 0.0, 0.0, 0.0]},
        {"quaternion": [0.9, 0.1, 0.0, 0.0], "actuators": "none"},
        {"joints": [*JOINTS[:5], 1e-5], "controller": "tde_stc"},
        {"quaternion": [0.9, 0.1, 0.0, 0.0], "controller": None},
    ],
)
def test_where_there_is_no_step_nothing_is_said(options: Any) -> None:
    """Also of a base that nothing turns, and of a flight that no law flies."""
    flight = scenario(**options).check()
    assert flight.start_step is None
    assert "start_step" not in flight.description
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        if flight.law.name != "none":
            assert scenario(**options).fly().metrics["start_step"] is None


def test_simulate_and_analyze_tell_the_same(space_robot: Run, tmp_path: Any) -> None:
    joints = ",".join(map(str, [*JOINTS[:5], 5.0]))
    words = (
        "simulate",
        "--controller",
        "ctc",
        "--duration",
        "0.2",
        "--bag",
        str(tmp_path / "bag"),
        "--set",
        f"plant.initial_joints_deg=[{joints}]",
    )
    flown = space_robot(*words, "--json")
    told = json.loads(flown.out)["start_step"]
    assert f"warning: {sentence(told)}" in flown.err.splitlines()
    assert json.loads(space_robot("analyze", tmp_path / "bag", "--json").out)["start_step"] == told
    assert " ".join(sentence(told).split()) in " ".join(
        space_robot("analyze", tmp_path / "bag").out.split()
    )
