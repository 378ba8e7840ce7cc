"""A step of the plant, and what each law costs the on-board computer in a tick."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from kernels import Array, controller_ticks, forward_dynamics_calls, plant_steps
from measuring import Competitor, Row, Run, repeated, timed
from scipy import optimize

from space_robot import Scenario
from space_robot.flight.batch import FlightBatch
from space_robot.flight.plan import Flight, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.controller.controller import Controller
from space_robot_control.laws import CompiledLaw, find_law
from space_robot_control.laws import laws as all_laws
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.files import named_file
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.samples import MOST_WHEELS, Command
from space_robot_sim.plant.plant import Plant

CASE = "3"
"""Friction, disturbances and payload."""
GEAR = {"rotor_inertia": 2e-4, "gear_ratio": 100.0, "stiffness": 1e4, "damping": 3.0}
ORBITS: dict[str, Any] = {
    "step, with gravity gradient": {"orbit": {"orbital_elements": {"height": 420e3}}},
    "step, with all of an orbit": {"orbit": "iss"},
}
BESIDE = "ctc"
"""The law that the others stand beside."""
TICKS = 2000
MPC_LAW = Path(__file__).resolve().parents[2] / "examples/mpc_law.py"
HORIZONS = (1, 5, 10, 20)
"""Numbers of steps; all but the first cover 0.9 s."""
FIRST_S = 5e-3
LONGEST_S = FIRST_S * (1.6**10 - 1.0) / 0.6
LIMIT = 0.7
"""N m on each axis of the base; case 1 asks for up to 1.1 in its first leg."""


def flight_of(**settings: Any) -> Flight:
    """Return a new flight."""
    return Flight(resolve(Scenario.model_validate(settings)))


def moving_plant(**options: Any) -> Plant:
    """Return the plant of case 3 with every joint turning, so that everything acts."""
    plant = flight_of(case=CASE, duration=1.0, **options).plant
    n = plant.robot.n
    plant.block[0].x[13 + n : 13 + 2 * n] = 0.1
    return plant


def steps_of(plant: Plant) -> Competitor:
    """Return its steps in a compiled loop, under no torque."""
    torque = np.zeros(len(plant.names.commanded))

    def steps(count: int) -> object:
        buffer = plant.command_delay_buffer
        return plant_steps(plant.block, buffer, torque, 0, count, plant.period)

    return steps


def forward_dynamics_of(plant: Plant) -> Competitor:
    """Return its forward dynamics in the present state."""
    force = np.zeros(plant.robot.n + 6 + MOST_WHEELS)
    return lambda calls: forward_dynamics_calls(plant.block, force, calls)


def plant(run: Run) -> Iterator[Row]:
    """Time a step (RK4, 0.5 ms, case 3) in a compiled loop and from Python, and what it has."""
    run.progress("one plant step, from compiled code and from Python")
    geared: Any = read_yaml(named_file("robots", "paper"))
    for link in geared["robot"]["links"]:
        link["drive"] = GEAR
    looped, called = moving_plant(), moving_plant()
    with_wheels = moving_plant(actuators="wheels")
    n = looped.robot.n
    with_wheels.memory.x[13 + 2 * n :][:4] = 50.0
    command = Command(0, np.zeros(n + 3))
    first = "step, compiled loop"
    seconds = run.interleave(
        {
            first: steps_of(looped),
            "step, one call from Python": repeated(lambda: called.step(command)),
            **{name: steps_of(moving_plant(**orbit)) for name, orbit in ORBITS.items()},
            "step, with six gears": steps_of(moving_plant(plant_robot=geared)),
            "step, with four wheels": steps_of(with_wheels),
            "forward dynamics": forward_dynamics_of(moving_plant()),
        }
    )
    yield timed(first, "us", seconds[first], ("real time", [looped.period]))
    for name in [name for name in seconds if name != first]:
        yield timed(name, "us", seconds[name], (first, seconds[first]))


def controller_ticks_of(law_name: str, number: int) -> Competitor:
    """Fly case 3 under a law; return a controller's ticks (signals, law, torque) over its rows."""
    flight = flight_of(controller=law_name, case=CASE)
    flight.ticks = number
    log, law, period = simulate(flight), flight.controller.law, flight.period
    states = np.concatenate([state.block for state in log.states(0, number)])
    references, controller = log.references(0, number), Controller(flight.robot, law, period)
    assert isinstance(law, CompiledLaw)
    code, rows = law.code, (states, references)
    torque, allocate = np.zeros_like(code.memory[0].force), controller.allocate
    return lambda ticks: controller_ticks(
        code, allocate, controller.block, *rows, ticks, torque, period
    )


def laws(run: Run) -> Iterator[Row]:
    """Time a controller's tick under each law, and a tick of whole flights, alone and in lanes."""
    names = [BESIDE, *(name for name in all_laws() if name != BESIDE)]
    run.progress("one tick of each law")
    ticks = 100 if run.short else TICKS
    seconds = run.interleave({name: controller_ticks_of(name, ticks) for name in names})
    for name in names:
        beside = (f"{BESIDE}, tick", seconds[BESIDE]) if name != BESIDE else ("", ())
        yield timed(f"{name}, tick", "us", seconds[name], beside)
    run.progress("whole flights under each law")
    settings = {"sensors": "fine", "navigation": "filtered", "gains": "robust"}
    duration = 0.05 if run.short else 0.5
    for name in names:
        flight = {"controller": name, "duration": duration, **settings}
        yield ticks_in_lanes(run, f"{name}, flight in lanes", flight)


def ticks_in_lanes(run: Run, title: str, settings: dict[str, Any]) -> Row:
    """Time a tick of a whole flight in lanes, beside one alone; flights are made outside of it."""
    alone, together = [], []
    for _ in range(run.batches(7)):
        one, eight = flight_of(**settings), [flight_of(**settings, seed=k) for k in range(WIDTH)]
        alone.append(elapsed(partial(simulate, one)) / one.ticks)
        batch = FlightBatch(eight)
        together.append(elapsed(partial(_fly_all, batch)) / (WIDTH * one.ticks))
    return timed(title, "us", together, ("alone", alone))


def _fly_all(batch: FlightBatch) -> None:
    for _ in batch.fly():
        pass


def elapsed(function: Callable[[], object]) -> float:
    """Return the seconds of a call."""
    begun = time.perf_counter()
    function()
    return time.perf_counter() - begun


def mpc(run: Run) -> Iterator[Row]:
    """Time a controller's answer under examples/mpc_law.py, which solves a QP, by its horizon."""
    number = 100 if run.short else TICKS
    laws = {name: controller_ticks_of(name, number) for name in ("ctc", "tde_stc")}
    for name, seconds in run.interleave(laws, 5).items():
        yield timed(f"{name}, compiled", "us", seconds)
    for steps in HORIZONS:
        run.progress(f"flights with {steps} steps")
        flights = [_fly(steps, 0.05 if run.short else 5.0) for _ in range(run.batches(5))]
        for what, of in (("median", np.median), ("99 %", lambda x: np.quantile(x, 0.99))):
            yield timed(f"{steps} steps, {what}", "us", [float(of(f[0])) for f in flights])
        late = tuple(100.0 * float(np.mean(flight[1] > 5e-4)) for flight in flights)
        yield Row(f"{steps} steps, later than 500 us by the wall clock", "%", late)


def _fly(steps: int, duration: float) -> Array:
    """Fly case 1 with a weak base; seconds of each answer, (2, ticks): processor, wall clock."""
    law: Any = find_law(f"{MPC_LAW}:ModelPredictiveControl")
    bench = Scenario(
        case="1",
        duration=duration,
        parameters={"plant": {"base_torque_limit": LIMIT}},
        controller=type("Mpc", (law,), {"steps": _horizon(steps)}),
        gains={"weight": 1.0, "torque_limit": [LIMIT] * 3 + [1e3] * 6},
    ).bench()
    bench.step()
    times = []
    while not bench.done:
        begun = time.perf_counter(), time.thread_time()
        bench.command()
        times.append((time.thread_time() - begun[1], time.perf_counter() - begun[0]))
        bench.step()
    return np.array(times).T


def _horizon(steps: int) -> Array:
    """Return lengths of steps (N,), s: each is longer than the one before by one factor."""
    powers = np.arange(steps)

    def beyond(factor: float) -> float:
        return float(FIRST_S * (factor**powers).sum() - LONGEST_S)

    factor = optimize.brentq(beyond, 1.0, 100.0, xtol=1e-12) if steps > 1 else 1.0
    return np.array(FIRST_S * factor**powers)
