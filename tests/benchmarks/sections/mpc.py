"""The model predictive law of examples/mpc_law.py: its ticks, and its QP by three solvers."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from paths import ROOT
from scipy import sparse

from space_robot import Scenario
from space_robot_control.laws import find_law

from ..measure import Options, interleave
from ..peers import is_installed
from ..result import Result, Target
from .laws import Recorded

Array = NDArray[np.float64]
Bounds = tuple[Array, Array, Array]
"""(N m, N m) torque by z, upper and lower limits (N m,)."""
Solver = Callable[[Bounds], Array]
"""Returns what is added to the first u without limits, (m,)."""

HORIZONS = (1, 5, 10, 20)
"""Numbers of steps; all but the first cover 0.9 s."""
LONGEST_S = 5e-3 * (1.6**10 - 1.0) / 0.6
LIMIT = 0.7
"""N m on each axis of the base; case 1 asks for up to 1.1 in its first leg."""
PERIOD_S = 5e-4
PERIOD_US = Target(1e6 * PERIOD_S)
AXES = 9


@dataclass
class TimedSolver:
    """DAQP as the law calls it, with the time of each call and every twentieth problem."""

    solver: Any
    seconds: list[float] = field(default_factory=list)
    problems: list[Bounds] = field(default_factory=list)
    _begun: float = 0.0

    def update(self, hessian: None, slope: None, *bounds: Array) -> None:
        """Begin a problem."""
        if len(self.seconds) % 20 == 0:
            self.problems.append((bounds[0], bounds[1], bounds[2]))
        self._begun = time.thread_time()
        self.solver.update(hessian, slope, *bounds)

    def solve(self) -> Any:
        """Solve it."""
        solution = self.solver.solve()
        self.seconds.append(time.thread_time() - self._begun)
        return solution


@dataclass(frozen=True)
class TimedFlight:
    """Times of every tick of a flight, s."""

    tick: Array
    """Of the processor, for a controller's answer: signals, law, torque."""
    wall: Array
    """The same by the wall clock."""
    solver: Array
    """Of the processor, for the QP."""
    law: Any
    problems: list[Bounds]

    @classmethod
    def of(cls, steps: int, duration: float) -> TimedFlight:
        """Fly case 1 with a weak base."""
        bench = scenario(steps, duration).bench()
        bench.step()
        law = bench.controller.law
        timed = law.solver = TimedSolver(law.solver)  # type: ignore[attr-defined]
        times = []
        while not bench.done:
            begun = time.perf_counter(), time.thread_time()
            bench.command()
            times.append((time.thread_time() - begun[1], time.perf_counter() - begun[0]))
            bench.step()
        tick, wall = np.array(times).T
        return cls(tick, wall, np.array(timed.seconds), law, timed.problems)


def scenario(steps: int, duration: float) -> Scenario:
    """Case 1 under the law with a horizon of some steps, and a weak base."""
    law: Any = find_law(f"{ROOT / 'examples/mpc_law.py'}:ModelPredictiveControl")
    return Scenario(
        case="1",
        duration=duration,
        parameters={"plant": {"base_torque_limit": LIMIT}},
        controller=type("Mpc", (law,), {"steps": horizon(steps)}),
        gains={"weight": 1.0, "torque_limit": [LIMIT] * 3 + [1e3] * 6},
    )


def horizon(steps: int) -> Array:
    """Lengths of steps (N,), s: the first is 5 ms, the others grow by one factor."""
    if steps == 1:
        return np.array([5e-3])
    low, high = 1.0 + 1e-9, 100.0
    for _ in range(100):  # bisection
        factor = 0.5 * (low + high)
        long = 5e-3 * (factor**steps - 1.0) / (factor - 1.0) > LONGEST_S
        low, high = (low, factor) if long else (factor, high)
    lengths: Array = 5e-3 * low ** np.arange(steps)
    return lengths


def mpc(options: Options) -> list[Result]:
    """A tick of the law over the horizon, beside those of compiled laws; then the solvers."""
    if not is_installed("daqp"):
        options.progress("nothing: the law needs daqp (extra `mpc`)")
        return []
    results = []
    laws = {name: Recorded.of(name, 100 if options.short else 2000) for name in ("ctc", "tde_stc")}
    ticks = {name: recorded.whole_tick()[0] for name, recorded in laws.items()}
    compiled = interleave(
        ticks, options.batches(5), batch_s=options.batch_s, clock=time.thread_time
    )
    results += [Result.timed(f"{name}, compiled tick", "us", s) for name, s in compiled.items()]
    for steps in (HORIZONS[0],) if options.short else HORIZONS:
        options.progress(f"flights with {steps} steps")
        flights = [
            TimedFlight.of(steps, 0.05 if options.short else 5.0) for _ in range(options.batches(5))
        ]
        for what, seconds in (
            ("a tick", [flight.tick for flight in flights]),
            ("a tick, wall clock", [flight.wall for flight in flights]),
            ("DAQP", [flight.solver for flight in flights]),
        ):
            for name, share in (("median", 0.5), ("99 %", 0.99)):
                values = [float(np.quantile(each, share)) for each in seconds]
                is_asked = what == "a tick" and not options.short
                target = PERIOD_US if is_asked else None
                results.append(
                    Result.timed(f"{steps} steps, {what}, {name}", "us", values, target=target)
                )
        late = tuple(100.0 * float(np.mean(flight.wall > PERIOD_S)) for flight in flights)
        results.append(Result(f"{steps} steps, later than 500 us by the wall clock", "%", late))
        last = flights[-1]
        is_active = [bool(np.any((p[1] < 0.0) | (p[2] > 0.0))) for p in last.problems]
        for label, wanted in (("limits active", True), ("none active", False)):
            pairs = zip(last.problems, is_active, strict=True)
            if problems := [problem for problem, active in pairs if active is wanted]:
                results += solvers(options, f"{steps} steps, {label}", last.law, problems[:200])
    return results


def solvers(options: Options, title: str, law: Any, problems: Sequence[Bounds]) -> list[Result]:
    """Median and 99th percentile of a solution, in turns, each warm from the problem before."""
    makers = {"daqp": daqp_solver, "osqp": osqp_solver, "piqp": piqp_solver}
    ready = {name: make(law, problems[0]) for name, make in makers.items() if is_installed(name)}
    times: dict[str, list[float]] = {name: [] for name in ready}
    errors = dict.fromkeys(ready, 0.0)
    for problem in problems:
        best = ready["daqp"](problem)
        for name, solve in ready.items():
            begun = time.thread_time()
            change = solve(problem)
            times[name].append(time.thread_time() - begun)
            errors[name] = max(errors[name], float(np.abs(change - best).max()))
    return [
        Result.timed(
            f"{title}, {name}, {what}",
            "us",
            [float(np.quantile(seconds, share))],
            note=f"{len(problems)} problems; u differs from DAQP's by at most {errors[name]:.1e}"
            if what == "median"
            else "",
        )
        for name, seconds in times.items()
        for what, share in (("median", 0.5), ("99 %", 0.99))
    ]


def daqp_solver(law: Any, first: Bounds) -> Solver:
    """DAQP as in the law."""
    import daqp

    model, size = daqp.Model(), len(first[1])
    model.setup(np.eye(size), np.zeros(size), *first)
    root = law.root[0][:, None] / np.sqrt(law.gains.weight)

    def solve(problem: Bounds) -> Array:
        model.update(None, None, *problem)
        change: Array = (root * model.solve()[0].reshape(root.shape)).sum(axis=0)
        return change

    return solve


def sparse_problem(law: Any, first: Bounds) -> tuple[Any, Any, Callable[[Bounds], Array]]:
    """The same QP in the changes of u of all steps (N m,): cost, torque, and the latter's data."""
    count, weight = len(law.steps), law.gains.weight
    scale = law.root[0, 0] / np.sqrt(weight)
    cost = sparse.kron(np.linalg.inv(law.root @ law.root.T), np.diag(weight), format="csc")

    def mass(problem: Bounds) -> Array:
        block: Array = problem[0].reshape(count, AXES, count, AXES)[0, :, 0] / scale
        return block

    torque = sparse.block_diag([np.ones((AXES, AXES))] * count, format="csc")

    def data(problem: Bounds) -> Array:
        return np.tile(mass(problem).ravel(order="F"), count)

    torque.data = data(first)
    return cost, torque, data


def osqp_solver(law: Any, first: Bounds) -> Solver:
    """OSQP, warm, to a tolerance of 1e-5."""
    import osqp

    cost, torque, data = sparse_problem(law, first)
    solver = osqp.OSQP()
    solver.setup(
        sparse.triu(cost, format="csc"),
        np.zeros(cost.shape[0]),
        torque,
        first[2],
        first[1],
        verbose=False,
        eps_abs=1e-5,
        eps_rel=1e-5,
    )

    def solve(problem: Bounds) -> Array:
        solver.update(Ax=data(problem), l=problem[2], u=problem[1])
        change: Array = solver.solve().x[:AXES]
        return change

    return solve


def piqp_solver(law: Any, first: Bounds) -> Solver:
    """PIQP, an interior point method; it has no warm start."""
    import piqp

    cost, torque, data = sparse_problem(law, first)
    solver = piqp.SparseSolver()

    solver.setup(cost, np.zeros(cost.shape[0]), G=torque, h_u=first[1], h_l=first[2])

    def solve(problem: Bounds) -> Array:
        torque.data = data(problem)
        solver.update(G=torque, h_u=problem[1], h_l=problem[2])
        solver.solve()
        return np.array(solver.result.x[:AXES])

    return solve
