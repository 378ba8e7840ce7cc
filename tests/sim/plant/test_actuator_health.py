"""What the plant tells of wheels and thrusters in its diagnostics."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from space_robot_model.robot import Robot
from space_robot_msgs_py.samples import Command
from space_robot_sim.plant.actuator_health import ActuatorHealth
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

PERIOD = 5e-4


class Watched:
    """A plant that is asked for something, and what it tells."""

    def __init__(self, robot: Robot, actuators: str, **overrides: Any) -> None:
        settings = PlantNodeSettings.resolve({"actuators": actuators, **overrides})
        self.plant = Plant(robot, settings, PERIOD)
        self.health = ActuatorHealth(self.plant)

    def ask(self, *asked: float) -> None:
        command = np.zeros(len(self.plant.names.commanded))
        command[-len(asked) :] = asked
        self.plant.step(Command(self.plant.tick, command))


def test_an_ideal_base_has_nothing_to_tell(paper_robot: Robot) -> None:
    watched = Watched(paper_robot, "ideal")
    assert watched.health.values == {}
    assert watched.health.saturated() == ""


def test_wheels_tell_saturation_momentum_and_failure(paper_robot: Robot) -> None:
    faults = {"faults": ["wheel_fail@0.001:4"], "wheels.initial_speed": [314.0, -157.0, 0.0, 0.0]}
    watched = Watched(paper_robot, "small_wheels", **faults)
    share = 100.0 * 0.0796 * 314.0 / 50.0
    assert watched.health.values == {
        "momentum_percent: wheel_1": pytest.approx(share),
        "momentum_percent: wheel_2": pytest.approx(-0.5 * share),
        "momentum_percent: wheel_3": 0.0,
        "momentum_percent: wheel_4": 0.0,
    }
    for _ in range(3):
        watched.ask(0.1, 0.3, -0.19, 0.2)
    values = watched.health.values
    assert values["saturated_ticks: wheel_2"] == 3
    assert values["saturated_ticks: wheel_4"] == 2  # and dead since
    assert values["failed"] == "wheel_4"
    assert "saturated_ticks: wheel_1" not in values
    assert watched.plant.saturated_ticks == 3
    assert watched.health.saturated() == "wheel_2, wheel_4"
    assert watched.health.saturated() == ""
    watched.ask(0.3, 0.1, 0.1, 0.1)
    assert watched.health.saturated() == "wheel_1"


def test_thrusters_tell_pulses_and_propellant(paper_robot: Robot) -> None:
    overrides = {"thrusters.delay": [0.0], "faults": ["thruster_stuck_off@0:3"]}
    watched = Watched(paper_robot, "thrusters", **overrides)
    watched.ask(*[4.5, 0.0, 4.5, *np.zeros(9)])
    used = PERIOD * 4.5 / (226.1 * 9.80665)
    assert watched.health.values == {
        "pulses": 1,
        "propellant_used_kg": pytest.approx(used),
        "propellant_left_kg": pytest.approx(20.0 - used),
        "stuck_off": "thruster_3",
    }
    without_end = Watched(paper_robot, "thrusters", **{"thrusters.propellant": 0.0})
    assert "propellant_left_kg" not in without_end.health.values
