"""Lanes: eight flights in one step beside one flight, MuJoCo's step and MuJoCo's rollout."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np

import space_robot as sr
from space_robot.campaign.study import Study
from space_robot.flight.batch.batch import FlightBatch
from space_robot.flight.batch.compilation import compile_lanes
from space_robot.flight.batch.lane_memory import in_lanes
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_sim.plant.tick import PlantMemory

from ..kernels import lane_steps, plant_steps
from ..measure import Options, interleave
from ..peers import is_installed
from ..result import Result, Target
from .plant import moving_plant

FLIGHT = {"controller": "tde_stc", "sensors": "fine", "navigation": "filtered"}
SLIDING = 400
"""Steps after which the joints get their speed again, before friction stops them."""
RUNS = {1: 50, 2: 200}
"""Of the campaign, two laws each, by cores."""
ENVS = 1024
STEPS = 50


def lanes(options: Options) -> list[Result]:
    """A plant's step, a whole tick, flights of a campaign, steps of environments."""
    compile_lanes()
    return [*_steps(options), *_ticks(options), *_campaigns(options), *_environments(options)]


def _steps(options: Options) -> list[Result]:
    """A step of case 3 a flight, in compiled loops."""
    options.progress("a plant step, alone and in lanes")
    one, eight = moving_plant(), moving_plant()
    n, period = one.robot.n, one.period
    memory = in_lanes(PlantMemory, n)
    memory.alone[:] = eight.block[0]
    memory.numbers[:] = memory.numbers_alone.T
    buffer, torque = np.zeros((*eight.command_delay_buffer.shape, WIDTH)), np.zeros((n + 3, WIDTH))
    moving, start = memory.numbers.copy(), one.block.copy()

    def in_eight(steps: int) -> None:
        for _ in range(0, steps, WIDTH * SLIDING):
            memory.numbers[:] = moving
            lane_steps(memory.block, memory.alone, buffer, torque, SLIDING, period)

    def alone(steps: int) -> None:
        for _ in range(0, steps, SLIDING):
            one.block[:] = start
            plant_steps(one.block, one.command_delay_buffer, np.zeros(n + 3), 0, SLIDING, period)

    competitors: dict[str, Callable[[int], object]] = {"lanes": in_eight, "alone": alone}
    if is_installed("mujoco"):
        competitors |= _mujoco(one.robot)
    seconds = interleave(competitors, options.batches(), batch_s=options.batch_s)
    names = {"alone": "alone", "mujoco": "mj_step", "rollout": "mujoco's rollout, 8 states"}
    return [
        Result.timed(
            "plant step a flight, 8 in lanes",
            "us",
            seconds["lanes"],
            (names[other], seconds[other]),
            options.asked(Target(0.8)) if other == "alone" else None,
        )
        for other in names
        if other in seconds
    ]


def _mujoco(robot: Any) -> dict[str, Callable[[int], object]]:
    import mujoco
    from mujoco import rollout

    from ..peers.simulators import FRICTION, MuJoCo, Start

    peer = MuJoCo(Start.moving(robot), FRICTION.viscous)
    kind = mujoco.mjtState.mjSTATE_FULLPHYSICS
    state = np.zeros(mujoco.mj_stateSize(peer.model, kind))
    mujoco.mj_getState(peer.model, peer.data, state, kind)
    states, data = np.tile(state, (WIDTH, 1)), mujoco.MjData(peer.model)

    def roll(steps: int) -> None:
        rollout.rollout(peer.model, data, states, nstep=max(1, steps // WIDTH))

    return {"mujoco": peer.step, "rollout": roll}


def _flights(duration: float, count: int) -> list[Flight]:
    options = {**FLIGHT, "case": "1", "duration": duration}
    return [sr.Scenario(seed=seed, **options).check() for seed in range(count)]


def _ticks(options: Options) -> list[Result]:
    """Whole ticks: sensors, navigation, law, plant and log."""
    options.progress("whole ticks, alone and in lanes")
    duration = 0.1 if options.short else 2.0
    seconds: dict[str, list[float]] = {"alone": [], "lanes": []}
    for _ in range(options.batches(usual=7)):
        for name, took in time_ticks(lambda count: _flights(duration, count)).items():
            seconds[name].append(took)
    beside, asked = ("alone", seconds["alone"]), options.asked(Target(5.0, of="ratio"))
    name = "tick a flight, tde_stc, fine sensors, filtered"
    return [Result.timed(name, "us", seconds["lanes"], beside, asked)]


def time_ticks(flights_of: Callable[[int], list[Flight]]) -> dict[str, float]:
    """Return the seconds of a tick of a whole flight: one ``alone``, and eight in ``lanes``.

    Args:
        flights_of: returns so many new flights.
    """
    (one,), eight = flights_of(1), FlightBatch(flights_of(WIDTH))
    return {
        "alone": _timed(lambda: simulate(one)) / one.ticks,
        "lanes": _timed(lambda: list(eight.fly())) / (WIDTH * one.ticks),
    }


def _timed(function: Callable[[], object]) -> float:
    began = time.perf_counter()
    function()
    return time.perf_counter() - began


def _campaigns(options: Options) -> list[Result]:
    """Flights of 5 s of a campaign; with a time limit they are flown one by one."""
    options.progress("flights of a campaign, together and one by one")
    duration = 0.2 if options.short else 5.0
    study = Study.model_validate(
        {
            "scenario": {"case": "3", "sensors": "fine", "duration": duration},
            "laws": ["tde_stc", "ctc"],
            "vary": {"robot.links[*].mass": {"normal": 1.0, "sigma": 0.05, "relative": True}},
        }
    )
    each: dict[tuple[int, str], list[float]] = {
        (workers, name): [] for workers in RUNS for name in ("one by one", "together")
    }
    for _ in range(options.batches(usual=3)):
        for (workers, name), seconds in each.items():
            runs = 8 if options.short else RUNS[workers]
            campaign, limit = sr.Campaign(study), 1e6 if name == "one by one" else None
            took = _timed(
                lambda c=campaign, r=runs, w=workers, s=limit: c.run(r, 7, workers=w, timeout_s=s)
            )
            seconds.append(took / (2 * runs))
    return [
        Result.timed(
            f"flight of 5 s of a campaign, {workers} core{'s' if workers > 1 else ''}",
            "ms",
            each[workers, "together"],
            ("one by one", each[workers, "one by one"]),
            options.asked(Target(4.0, of="ratio")),
        )
        for workers in RUNS
    ]


def _environments(options: Options) -> list[Result]:
    """Steps of the task reach in a second, a tick each."""
    if not is_installed("gymnasium"):
        return []
    options.progress("steps of environments")
    count = WIDTH if options.short else ENVS
    many, one = sr.make_vec("reach", num_envs=count, threads=2), sr.make("reach")
    actions = np.random.default_rng(0).uniform(-0.1, 0.1, (count, many.task.n + 3))
    many.reset(seed=0)
    one.reset(seed=0)
    for _ in range(STEPS):
        many.step(actions)
    rates: dict[str, list[float]] = {"many": [], "one": []}
    for _ in range(options.batches(usual=7)):
        rates["many"].append(
            STEPS * count / _timed(lambda: [many.step(actions) for _ in range(STEPS)])
        )
        one.reset(seed=0)
        rates["one"].append(STEPS / _timed(lambda: [one.step(actions[0]) for _ in range(STEPS)]))
    many.close()
    return [
        Result(
            f"steps of {count} environments, 2 threads",
            "1/s",
            tuple(rates["many"]),
            None,
            options.asked(Target(1e6)),
            "more",
        ),
        Result("steps of one environment", "1/s", tuple(rates["one"]), better="more"),
    ]
