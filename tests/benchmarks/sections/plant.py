"""The plant: one step of the paper's robot, and what it is made of."""

from __future__ import annotations

import numpy as np

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.samples import MOST_WHEELS, Command
from space_robot_sim.plant.plant import Plant

from ..kernels import forward_dynamics_calls, plant_steps, state_derivatives
from ..measure import Options, interleave, repeated
from ..result import Result

CASE = "3"
"""Friction, disturbances and payload."""


def moving_plant() -> Plant:
    """The plant of case 3 with every joint turning, so that everything acts."""
    plant = Flight(resolve(FlightPlan(case=CASE, duration=1.0))).plant
    n = plant.robot.n
    plant.block[0].x[13 + n : 13 + 2 * n] = 0.1
    return plant


def plant(options: Options) -> list[Result]:
    """One step (RK4, 0.5 ms, case 3) in a compiled loop and from Python; its parts alone."""
    options.progress("one plant step, from compiled code and from Python")
    looped, called, parts = moving_plant(), moving_plant(), moving_plant()
    n, period = looped.robot.n, looped.period
    torque, command = np.zeros(n + 3), Command(0, np.zeros(n + 3))
    force, disturbance = np.zeros(n + 6 + MOST_WHEELS), np.zeros(n + 3)
    seconds = interleave(
        {
            "step": lambda steps: plant_steps(
                looped.block, looped.command_delay_buffer, torque, 0, steps, period
            ),
            "call": repeated(lambda: called.step(command)),
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
        Result.timed("forward dynamics", "us", seconds["dynamics"], step),
        Result.timed("state derivative", "us", seconds["derivative"], step),
    ]
