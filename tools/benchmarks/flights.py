"""Whole flights: alone, in campaigns, and eight at a time."""

from __future__ import annotations

from collections.abc import Iterator
from functools import partial
from typing import Any

import numpy as np
from kernels import lane_steps, plant_steps
from measuring import Competitor, Row, Run, repeated, timed
from plant import elapsed, flight_of, moving_plant, ticks_in_lanes

import space_robot as sr
from space_robot.analysis import analyze
from space_robot.campaign.study import Study
from space_robot.flight.compilation import compile_lanes
from space_robot.flight.lane_memory import in_lanes
from space_robot.flight.simulate import simulate as fly
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_sim.plant.tick import PlantMemory

SLIDING = 400
"""Steps after which the joints get their speed again, before friction stops them."""
RUNS = {1: 50, 2: 200}
"""Of the campaign in lanes, two laws each, by cores."""
FLIGHTS = {5.0: 32, 30.0: 16}
"""Of a campaign beside single flights, by their s: the same number of eights for two workers."""
MASS = {"normal": 1.0, "sigma": 0.05, "relative": True}
"""Of the links in campaigns."""
ENVIRONMENTS, STEPS = 1024, 50


def simulate(run: Run) -> Iterator[Row]:
    """Time 30 s closed loop, warm: reading the plan, flying, and in rows of its own analysing."""
    duration = 0.1 if run.short else 30.0
    run.progress(f"flights of {duration:g} s in this process")

    def flight(law: str, is_analyzed: bool) -> None:
        log = fly(flight_of(controller=law, duration=duration))
        if is_analyzed:
            analyze(log)

    parts = {
        f"{law}{', analyzed' * is_analyzed}": repeated(partial(flight, law, is_analyzed))
        for law in ("tde_stc", "ctc")
        for is_analyzed in (False, True)
    }
    for name, seconds in run.interleave(parts, 7).items():
        yield timed(f"{name}, {duration:g} s", "s", seconds, ("real time", [duration]))


def campaign(run: Run) -> Iterator[Row]:
    """Time a flight of a campaign, its row included, beside single flights that are analyzed."""
    for duration, number in ((0.2, 2),) if run.short else tuple(FLIGHTS.items()):
        run.progress(f"{number} flights of {duration:g} s, single and as campaigns")
        settings = {"case": "1", "duration": duration}
        study = Study(scenario=settings, laws=["tde_stc"], vary={"robot.links[*].mass": MASS})
        single = partial(_single, {"controller": "tde_stc", **settings}, number)
        first = "single flights"
        parts: dict[str, Competitor] = {first: repeated(single)}
        for workers in (1, 2):
            flown = partial(sr.Campaign(study).run, number, 7, workers=workers)
            parts[f"campaign, {workers} worker{'s' * (workers > 1)}"] = repeated(flown)
        each = run.interleave(parts, 5, batch_s=0.0)
        times = {name: [s / number for s in each[name]] for name in each}
        for name in times:
            beside = ("", ()) if name == first else (first, times[first])
            yield timed(f"{name}, {duration:g} s", "ms", times[name], beside)


def _single(settings: dict[str, Any], number: int) -> None:
    for _ in range(number):
        analyze(fly(flight_of(**settings)))


def lanes(run: Run) -> Iterator[Row]:
    """Time a plant's step, a whole tick, flights of a campaign, steps of environments."""
    compile_lanes()
    yield from _lane_steps(run)
    run.progress("whole ticks, alone and in lanes")
    flight = {"controller": "tde_stc", "sensors": "fine", "navigation": "filtered", "case": "1"}
    duration = 0.1 if run.short else 2.0
    title = "tick a flight, tde_stc, fine sensors, filtered"
    yield ticks_in_lanes(run, title, {**flight, "duration": duration})
    yield from _campaigns_in_lanes(run)
    yield from _environments(run)


def _lane_steps(run: Run) -> Iterator[Row]:
    """A step of case 3 a flight, in compiled loops; MuJoCo's, and its rollout of eight states."""
    run.progress("a plant step, alone and in lanes")
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

    competitors: dict[str, Competitor] = {"lanes": in_eight, "alone": alone}
    try:
        from simulators import FRICTION, MuJoCo, Start
    except ImportError:
        run.progress("... without MuJoCo, which is not installed")
    else:
        peer = MuJoCo(Start.moving(one.robot), FRICTION.viscous)
        competitors |= {"mj_step": peer.step, "mujoco's rollout, 8 states": peer.rollout(WIDTH)}
    seconds = run.interleave(competitors)
    for other in list(competitors)[1:]:
        title = "plant step a flight, 8 in lanes"
        yield timed(title, "us", seconds["lanes"], (other, seconds[other]))


def _campaigns_in_lanes(run: Run) -> Iterator[Row]:
    """Flights of 5 s of a campaign; with a time limit they are flown one by one."""
    run.progress("flights of a campaign, together and one by one")
    scenario = {"case": "3", "sensors": "fine", "duration": 0.2 if run.short else 5.0}
    study = Study(scenario=scenario, laws=["tde_stc", "ctc"], vary={"robot.links[*].mass": MASS})
    for workers, number in RUNS.items():
        runs = 8 if run.short else number
        times: dict[str, list[float]] = {"one by one": [], "together": []}
        for _ in range(run.batches(3)):
            for name, seconds in times.items():
                limit = 1e6 if name == "one by one" else None
                work = partial(sr.Campaign(study).run, runs, 7, workers=workers, timeout_s=limit)
                seconds.append(elapsed(work) / (2 * runs))
        title = f"flight of 5 s of a campaign, {workers} core{'s' * (workers > 1)}"
        yield timed(title, "ms", times["together"], ("one by one", times["one by one"]))


def _environments(run: Run) -> Iterator[Row]:
    """Steps of the task reach in a second, a tick each."""
    try:
        import gymnasium  # noqa: F401
    except ImportError:
        return
    run.progress("steps of environments")
    count = WIDTH if run.short else ENVIRONMENTS
    many, one = sr.make_vec("reach", num_envs=count, threads=2), sr.make("reach")
    actions = np.random.default_rng(0).uniform(-0.1, 0.1, (count, many.task.n + 3))
    for environment, action in ((many, actions), (one, actions[0])):
        environment.reset(seed=0)
        _step(environment, action)
    rates: dict[str, list[float]] = {"many": [], "one": []}
    for _ in range(run.batches(7)):
        one.reset(seed=0)
        rates["many"].append(STEPS * count / elapsed(partial(_step, many, actions)))
        rates["one"].append(STEPS / elapsed(partial(_step, one, actions[0])))
    many.close()
    name = f"steps of {count} environments, 2 threads"
    own, other = tuple(rates["many"]), tuple(rates["one"])
    yield Row(name, "1/s", own, "one environment", other, is_rate=True)


def _step(environment: Any, action: Any) -> None:
    for _ in range(STEPS):
        environment.step(action)
