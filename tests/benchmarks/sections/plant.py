"""The plant: one step of the paper's robot, what it is made of, and what orbit and gears cost."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.samples import MOST_WHEELS, Command
from space_robot_sim.plant.plant import Plant

from ..kernels import forward_dynamics_calls, plant_steps, state_derivatives
from ..measure import Options, interleave, repeated
from ..result import Result

Array = NDArray[np.float64]

CASE = "3"
"""Friction, disturbances and payload."""


GRAVITY = {"orbital_elements": {"height": 420e3}}
GEAR = {"rotor_inertia": 2e-4, "gear_ratio": 100.0, "stiffness": 1e4, "damping": 3.0}


def geared_robot() -> dict[str, Any]:
    """The paper's robot with a gear in every joint."""
    content = read_yaml(named_file("robots", "paper"))
    for link in content["robot"]["links"]:
        link["drive"] = GEAR
    return content


def moving_plant(**options: Any) -> Plant:
    """The plant of case 3 with every joint turning, so that everything acts."""
    plant = Flight(resolve(FlightPlan(case=CASE, duration=1.0, **options))).plant
    n = plant.robot.n
    plant.block[0].x[13 + n : 13 + 2 * n] = 0.1
    return plant


def _steps_of(plant: Plant, torque: Array) -> Callable[[int], object]:
    def steps(count: int) -> object:
        buffer = plant.command_delay_buffer
        return plant_steps(plant.block, buffer, torque, 0, count, plant.period)

    return steps


def plant(options: Options) -> list[Result]:
    """One step (RK4, 0.5 ms, case 3) in a compiled loop and from Python; its parts alone."""
    options.progress("one plant step, from compiled code and from Python")
    looped, called, parts = moving_plant(), moving_plant(), moving_plant()
    worlds = {
        "gravity": moving_plant(orbit=GRAVITY),
        "orbit": moving_plant(orbit="iss"),
        "gears": moving_plant(plant_robot=geared_robot()),
    }
    n, period = looped.robot.n, looped.period
    torque, command = np.zeros(n + 3), Command(0, np.zeros(n + 3))
    force, disturbance = np.zeros(n + 6 + MOST_WHEELS), np.zeros(n + 3)
    seconds = interleave(
        {
            "step": _steps_of(looped, torque),
            "call": repeated(lambda: called.step(command)),
            **{name: _steps_of(plant, torque) for name, plant in worlds.items()},
            "dynamics": lambda calls: forward_dynamics_calls(parts.block, force, calls),
            "derivative": lambda calls: state_derivatives(parts.block, disturbance, calls),
        },
        options.batches(),
        batch_s=options.batch_s,
    )
    step = ("a step, compiled loop", seconds["step"])
    return [
        Result.timed("step, compiled loop", "us", seconds["step"], ("real time", [period])),
        Result.timed("step, one call from Python", "us", seconds["call"], step),
        Result.timed("step, with gravity gradient", "us", seconds["gravity"], step),
        Result.timed("step, with all of an orbit", "us", seconds["orbit"], step),
        Result.timed("step, with six gears", "us", seconds["gears"], step),
        Result.timed("forward dynamics", "us", seconds["dynamics"], step),
        Result.timed("state derivative", "us", seconds["derivative"], step),
    ]
