"""The curves beside the scene, by search over stretches, and the data of the page."""

from __future__ import annotations

import json
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scene_pages import moving_log
from scipy.spatial.transform import Rotation

from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.plotted import PlottedQuantity, flown_quantities
from space_robot.view.flights import STRETCHES, Plot, Series, extremes, flight_plots, render
from space_robot_control.allocation.settings import assumed_actuators
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_model.robot.parts import Gear
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

NUMBERS = st.one_of(st.floats(-1e3, 1e3), st.sampled_from([0.0, np.nan, np.inf, -np.inf]))


@given(
    st.lists(NUMBERS, min_size=1, max_size=60), st.integers(0, 40), st.integers(1, 30), st.data()
)
def test_each_stretch_has_its_lowest_and_highest_known_value(
    values: list[float], first: int, stretches: int, data: Any
) -> None:
    log = FlightLog.allocate(len(values), (), Timebase(250_000_000))  # exact in binary
    log.first_tick = first
    begin = data.draw(st.integers(0, first))
    edges = 0.25 * np.linspace(
        begin, first + len(values) - 1 + data.draw(st.integers(0, 20)), stretches + 1
    )
    shown = extremes(log, np.array(values), edges).reshape(-1, 2)
    times = 0.25 * (first + np.arange(len(values)))
    for k in range(stretches):
        inside = (times >= edges[k]) & ((times < edges[k + 1]) | (k == stretches - 1))
        known = np.array(values)[inside]
        known = known[np.isfinite(known)]
        expected = [known.min(), known.max()] if len(known) else [np.nan, np.nan]
        np.testing.assert_array_equal(shown[k], expected)


def flight(robot: Robot, actuators: str) -> FlightLog:
    """A log of 30 rows with the actuators of a name, its numbers at random."""
    hardware = assumed_actuators(actuators, robot) if actuators else BaseActuatorSettings()
    log, rng = moving_log(robot, 30), np.random.default_rng(7)
    log.wheel_velocities = rng.normal(size=(30, hardware.wheel_count))
    log.thrusts = rng.uniform(size=(30, hardware.thruster_count))
    for column in (log.passive_positions, log.applied_torque, log.base_position):
        column[:] = rng.normal(size=column.shape)
    if actuators:
        log.flight = {"base_actuators": hardware.model_dump(), "robot": robot.name}
    return log


def plotted_of(log: FlightLog, robot: Robot) -> list[PlottedQuantity]:
    analysed = AnalysedLog(log)
    analysed.robot = robot
    return [quantity for _, quantity in flown_quantities(analysed)]


def shown_of(log: FlightLog, robot: Robot) -> dict[str, PlottedQuantity]:
    return {quantity.title: quantity for quantity in plotted_of(log, robot)}


def test_drift_is_counted_from_the_first_known_row(paper_robot: Robot) -> None:
    log = flight(paper_robot, "none")
    log.quaternion[:3] = log.base_position[1] = np.nan
    shown = shown_of(log, paper_robot)
    assert not {"attitude error", "base torque", "wheel momentum", "thruster pulses"} & set(shown)
    moved = log.base_position - log.base_position[3]
    np.testing.assert_array_equal(shown["base drift"].values, moved)
    axes = Rotation.from_quat(log.quaternion[3:], scalar_first=True)
    turned = np.degrees((axes[0].inv() * axes).as_rotvec())
    assert shown["attitude drift"].unit == "deg"
    np.testing.assert_allclose(shown["attitude drift"].values[3:], turned, atol=1e-6)


def test_wheels_and_thrusters_by_their_description_or_what_the_log_has(paper_robot: Robot) -> None:
    log = flight(paper_robot, "wheels_and_thrusters")
    hardware = assumed_actuators("wheels_and_thrusters", paper_robot)
    shown = shown_of(log, paper_robot)
    inertia = np.broadcast_to(hardware.wheels.rotor_inertia, hardware.wheel_count)
    np.testing.assert_allclose(shown["wheel momentum"].values, log.wheel_velocities * inertia)
    force = np.broadcast_to(hardware.thrusters.force, hardware.thruster_count)
    np.testing.assert_allclose(shown["thruster pulses"].values, log.thrusts / force)
    assert shown["thruster pulses"].are_pulses
    log.flight = {}  # a bag of others
    log.thrusts[:, 1] = 0.0
    shown = shown_of(log, paper_robot)
    np.testing.assert_array_equal(shown["wheel speed"].values, log.wheel_velocities)
    largest = shown["thruster pulses"].values.max(axis=0)
    np.testing.assert_allclose(largest, np.arange(hardware.thruster_count) != 1)


def test_passive_joints_are_counted_from_their_rest() -> None:
    robot = find_robot("flexible_panels")
    rest = 0.1 * (1 + np.arange(len(robot.springs)))
    springs = tuple(s._replace(rest=r) for s, r in zip(robot.springs, rest, strict=True))
    log = flight(robot, "")
    log.flight = {"prismatic_joints": [robot.passive_names[1]]}
    quantities = plotted_of(log, replace(robot, springs=springs))
    turning, sliding = [q for q in quantities if q.title == "deflection"]
    away = log.passive_positions - rest
    assert (turning.unit, sliding.unit, sliding.labels) == ("rad", "m", [robot.passive_names[1]])
    np.testing.assert_array_equal(turning.values, np.delete(away, 1, axis=1))
    np.testing.assert_array_equal(sliding.values, away[:, 1:2])


@pytest.mark.parametrize(
    ("encoder", "has_truth", "expected"),
    [
        ("motor", True, [("rad", [0, 2]), ("m", [1])]),
        ("motor", False, []),
        ("link", False, [("rad", [0])]),
    ],
)
def test_motors_are_ahead_of_their_joints_by_the_gears_deflection(
    paper_robot: Robot, encoder: Any, has_truth: bool, expected: list[Any]
) -> None:
    """What a motor's encoder says is no joint's position: without the truth nothing is known."""
    gears: list[Gear | None] = [None] * paper_robot.n
    gears[0] = Gear(1e-4, 100.0, 2e4, 10.0, encoder)
    gears[2] = gears[-1] = Gear(1e-4, 50.0, 1e4)
    log, names = flight(paper_robot, ""), paper_robot.joint_names
    log.geared_names = (names[0], names[2], names[-1])
    log.motor_positions = np.random.default_rng(2).normal(size=(30, 3))
    log.flight = {"prismatic_joints": [names[2]]}
    if has_truth:
        log.record_measured()
    quantities = plotted_of(log, replace(paper_robot, gears=tuple(gears)))
    away = log.motor_positions - log.joint_positions[:, [0, 2, 5]]
    shown = [q for q in quantities if q.title == "gear deflection"]
    for quantity, (unit, columns) in zip(shown, expected, strict=True):
        assert quantity.unit == unit
        assert quantity.labels == [log.geared_names[k] for k in columns]
        np.testing.assert_array_equal(quantity.values, away[:, columns])


def test_of_several_flights_each_has_the_size_of_each_quantity(paper_robot: Robot) -> None:
    logs = {"a": flight(paper_robot, ""), "b": flight(paper_robot, "none")}
    _, drawn = flight_plots(logs, dict.fromkeys(logs, paper_robot), ["#1", "#2"])
    plots = {plot.title: plot for plot in drawn}
    assert [s.label for s in plots["torque 1-3"].series] == ["a", "b"]
    assert [(s.label, s.colour) for s in plots["attitude drift"].series] == [("b", "#2")]
    assert plots["attitude error"].logarithmic
    assert not plots["base drift"].logarithmic
    size = np.linalg.norm(logs["a"].applied_torque[:, 3:6], axis=1)
    shown = plots["torque 1-3"].series[0].values
    assert len(shown) == 2 * STRETCHES
    np.testing.assert_array_equal(shown[np.isfinite(shown)], np.repeat(size, 2))


NAMES = st.one_of(
    st.text(max_size=8),
    st.sampled_from(["<!--<script>", "</script>", "]]>", "\u2028", "&lt;", "'\""]),
)


@settings(max_examples=20)
@given(
    st.lists(NAMES, min_size=1, max_size=3),
    st.lists(NUMBERS, min_size=1, max_size=20),
    st.booleans(),
)
def test_the_page_has_whatever_names_and_values_of_four_digits(
    names: list[str], values: list[float], is_logarithmic: bool
) -> None:
    """And none where nothing can be drawn."""
    time = np.arange(len(values)) / 3.0
    series = [Series(name, "#112233", np.array(values)) for name in names]
    plot = Plot(names[0], "", series, is_logarithmic)
    others: dict[str, Any] = {"marks": [], "flights": [], "arrows": {}, "notes": names}
    page = render(names[0], True, time, [plot], scene=names[0], start=0.0, **others)
    (written,) = re.findall(r'<script id="data"[^>]*>(.*?)</script>', page, re.DOTALL)
    assert "<" not in written
    assert page.count("<script") == 3
    data = json.loads(written)
    (drawn,) = data["plots"]
    assert drawn["logarithmic"] == is_logarithmic
    assert [one["label"] for one in drawn["series"]] == names
    for value, number in zip(values, drawn["series"][-1]["values"], strict=True):
        if not np.isfinite(value) or (is_logarithmic and value <= 0.0):
            assert number is None
        else:
            assert number == pytest.approx(value, rel=5e-4, abs=0.0)
    np.testing.assert_allclose(data["time"], time, atol=5e-5)
