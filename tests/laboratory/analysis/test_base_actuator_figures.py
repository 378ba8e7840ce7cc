"""Figures of momentum, wheels and thrusters: they draw what was flown, of every such flight."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from actuator_sets import PYRAMID, flat, hardware, still_log
from matplotlib.axes import Axes
from numpy.typing import NDArray

from space_robot.analysis.described import momentum_of
from space_robot.analysis.figures import momentum, thrusters, wheels
from space_robot.analysis.figures.figure_set import FigureSet
from space_robot.analysis.figures.style import save_figure
from space_robot.analysis.momentum import Momentum
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

WHEELS = {"axes": PYRAMID, "max_momentum": [3.0], "max_torque": [0.5, 0.0, 0.5, 0.5]}
THRUSTERS = {
    "positions": flat([sign * axis for axis in np.eye(3) for sign in (1, -1, 1, -1)]),
    "directions": flat([sign * np.roll(axis, 1) for axis in np.eye(3) for sign in (1, -1, -1, 1)]),
    "force": [2.0],
}
BOTH = hardware(wheels=WHEELS, thrusters=THRUSTERS)
FREE = BaseActuatorSettings(base_actuation="none")
HARDWARE_FIGURES = {"momentum", "wheels", "thrusters"}


def lively_log(robot: Robot, actuators: BaseActuatorSettings, ticks: int = 50) -> FlightLog:
    log, rng = still_log(robot, ticks, actuators), np.random.default_rng(1)
    for name in ("omega_base", "joint_velocities", "wheel_velocities", "wheel_torques"):
        getattr(log, name)[:] = rng.normal(size=getattr(log, name).shape)
    log.thrusts[:] = 2.0 * (rng.random(log.thrusts.shape) < 0.5)
    return log


pytestmark = pytest.mark.filterwarnings("ignore:Data has no positive values")


def drawn(axes: Axes) -> list[NDArray[np.float64]]:
    return [np.asarray(line.get_ydata()) for line in axes.get_lines()]


def test_momentum_of_robot_wheels_and_sum(paper_robot: Robot) -> None:
    log = lively_log(paper_robot, hardware(wheels=WHEELS))
    found = momentum_of(log).add(log)
    figure = momentum(log, found, hardware(wheels=WHEELS))
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["robot", "wheels", "sum"]
    for i, axes in enumerate(figure.axes):
        for wanted in (found.robot, found.wheels, found.robot + found.wheels):
            assert any(np.array_equal(values, wanted[:, i]) for values in drawn(axes))


def test_of_a_free_base_what_arm_and_base_exchange(paper_robot: Robot) -> None:
    log = lively_log(paper_robot, FREE)
    found = momentum_of(log).add(log)
    figure = momentum(log, found, FREE)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["base", "arm", "sum"]
    outside = Momentum(*found._replace(outside=found.outside + 1.0))
    assert len(momentum(log, outside, FREE).legends[0].get_texts()) == 4


def test_wheels_stand_between_their_limits(paper_robot: Robot) -> None:
    log = lively_log(paper_robot, hardware(wheels=WHEELS))
    above, below = wheels(log, BOTH.wheels).axes
    for axes, values, limit in (
        (above, log.wheel_velocities * 0.01, 3.0),
        (below, log.wheel_torques, 0.5),
    ):
        curves = [y for y in drawn(axes) if len(y) == log.ticks]
        assert len(curves) == 4
        for column in values.T:
            assert any(np.allclose(y, column) for y in curves)
        assert sorted(y[0] for y in drawn(axes) if len(y) == 2) == [-limit, limit]


@pytest.mark.parametrize("ticks", [1, 50, 1300])
def test_the_raster_is_dark_where_a_thruster_is_open(paper_robot: Robot, ticks: int) -> None:
    log = lively_log(paper_robot, hardware(thrusters=THRUSTERS), ticks)
    pulses, used, *_ = thrusters(log, np.zeros((ticks, 3)), BOTH.thrusters).axes
    (image,) = pulses.get_images()
    shown = np.asarray(image.get_array())
    length = -(-ticks // shown.shape[1])
    assert shown.shape[0] == 12
    for column in (0, shown.shape[1] - 1):
        part = log.thrusts[column * length : (column + 1) * length] / 2.0
        np.testing.assert_allclose(shown[:, column], part.mean(axis=0))
    (curve,) = drawn(used)
    total = log.thrusts.sum() * log.timebase.period / (220.0 * 9.80665)
    assert curve[-1] == pytest.approx(1e3 * total)


@pytest.mark.parametrize(
    ("actuators", "names"),
    [
        (BOTH, {"momentum", "wheels", "thrusters"}),
        (hardware(wheels=WHEELS), {"momentum", "wheels"}),
        (hardware(thrusters=THRUSTERS), {"momentum", "thrusters"}),
        (FREE, {"momentum"}),
        (BaseActuatorSettings(), set()),
    ],
)
def test_each_flight_has_those_of_its_base(
    paper_robot: Robot, tmp_path: Path, actuators: BaseActuatorSettings, names: set[str]
) -> None:
    """Thrusters that never fired gave no torque at all, which has no spectrum."""
    figures = FigureSet()
    figures.add("one", still_log(paper_robot, 100, actuators))
    hardware = {k: v for k, v in figures.drawings().items() if k in HARDWARE_FIGURES}
    saved = {k for k, v in hardware.items() if save_figure(v.draw(), tmp_path / k)}
    assert saved == names


def test_of_several_flights_each_has_its_own(paper_robot: Robot, tmp_path: Path) -> None:
    figures = FigureSet()
    for name, actuators in (
        ("ideal", BaseActuatorSettings()),
        ("wheels", hardware(wheels=WHEELS)),
        ("free", FREE),
    ):
        figures.add(name, lively_log(paper_robot, actuators))
    captions = {figure.svg.stem: figure.caption for figure in figures.save(tmp_path)}
    assert captions["momentum_1"] == "Angular momentum about the common centre of mass of wheels"
    assert captions["momentum_2"] == "Angular momentum about the common centre of mass of free"
    assert "wheels_1" in captions


def test_a_bag_that_lies_about_its_base_has_the_other_figures(
    paper_robot: Robot, tmp_path: Path
) -> None:
    log = lively_log(paper_robot, FREE)
    log.flight["base_actuators"] = hardware(wheels=WHEELS).model_dump()
    figures = FigureSet()
    figures.add("one", log)
    assert {f.svg.stem for f in figures.save(tmp_path)}.isdisjoint({"momentum", "wheels"})
