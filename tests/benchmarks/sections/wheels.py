"""What wheels cost a step of the plant, and whether Basilisk's turn the same satellite alike."""

from __future__ import annotations

import numpy as np

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_sim.plant.plant import Plant

from ..kernels import plant_steps
from ..measure import Competitor, Options, interleave
from ..peers import is_installed
from ..peers.gyrostat import Gyrostat, OurGyrostat, apart
from ..result import Result, Target
from .plant import CASE

COST = 1.3
"""A step with four wheels may last so many times one with an ideal base torque."""
TOLERANCE = Target(1e-9)
"""Largest difference in quaternion, base rates (rad/s) and the wheels' speeds (share)."""
MOTION = Target(0.1)
"""The least that the attitude changes: at rest all are the same."""
FLOWN_S, FLOWN_SHORT_S = 60, 2


def wheels(options: Options) -> list[Result]:
    """One step (RK4, 0.5 ms, case 3) with four wheels beside one with an ideal base torque."""
    options.progress("one plant step with four wheels and without")
    seconds = interleave(
        {name: _stepped(name) for name in ("wheels", "ideal")},
        options.batches(31),
        batch_s=options.batch_s,
    )
    results = [
        Result.timed(
            "plant step, four wheels",
            "us",
            seconds["wheels"],
            ("ideal", seconds["ideal"]),
            options.asked(Target(1.0 / COST, of="ratio")),
        )
    ]
    if is_installed("Basilisk"):
        options.progress("a gyrostat beside Basilisk's")
        results += _beside_basilisk(FLOWN_SHORT_S if options.short else FLOWN_S)
    return results


def _stepped(actuators: str) -> Competitor:
    """Steps of the plant of case 3 with every joint and wheel turning."""
    flight = Flight(resolve(FlightPlan(case=CASE, duration=1.0, actuators=actuators)))
    plant: Plant = flight.plant
    n, x = plant.robot.n, plant.memory.x
    x[13 + n : 13 + 2 * n] = 0.1
    count = flight.plant_settings.wheels.count
    x[13 + 2 * n :][:count] = 50.0
    torque = np.zeros(n + 3 + count)

    def run(steps: int) -> None:
        plant_steps(plant.block, plant.command_delay_buffer, torque, 0, steps, plant.period)

    return run


def _beside_basilisk(seconds: int) -> list[Result]:
    from ..peers.basilisk_wheels import BasiliskGyrostat

    start = Gyrostat.turning(Flight(resolve(FlightPlan(duration=1.0))).plant.robot, seconds)
    both = np.array([*apart(start, OurGyrostat(start), BasiliskGyrostat(start))])
    differences, motion = both.max(axis=0).tolist()
    flown = f"arm locked, four wheels, {seconds} s"
    return [
        Result(f"{flown}: motion", "", (motion,), target=MOTION, better="more", is_condition=True),
        Result(f"{flown}: basilisk apart", "", (differences,), target=TOLERANCE, is_condition=True),
    ]
