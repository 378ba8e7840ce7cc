"""The bench: a tick stepped from Python."""

from __future__ import annotations

import numpy as np

from space_robot import Scenario

from ..measure import Competitor, Options, interleave
from ..result import Result, Target

STEP_US = Target(20.0, 10.0)
"""Asked of a step with a torque that is ready, us: 50,000 steps/s; 100,000 are wished."""
SCENARIOS = {
    "step": Scenario(controller=None),
    "step, fine sensors": Scenario(controller=None, sensors="fine"),
    "step, on wheels": Scenario(controller=None, actuators="wheels"),
    "step under its own tde_stc": Scenario(),
}


def python(options: Options) -> list[Result]:
    """A step of the bench, and saving and restoring it."""
    options.progress("steps from Python")
    competitors = {name: _steps(scenario) for name, scenario in SCENARIOS.items()}
    competitors["save and restore"] = _detours(SCENARIOS["step, fine sensors"])
    seconds = interleave(competitors, options.batches(), batch_s=options.batch_s)
    return [
        Result.timed(name, "us", times, target=options.asked(STEP_US) if name == "step" else None)
        for name, times in seconds.items()
    ]


def _steps(scenario: Scenario) -> Competitor:
    bench = scenario.bench()
    torque = np.zeros(bench.axes) if scenario.controller is None else None

    def run(loops: int) -> None:
        for _ in range(loops):
            if bench.done:
                bench.reset()
            bench.step(torque)

    return run


def _detours(scenario: Scenario) -> Competitor:
    bench = scenario.bench()

    def run(loops: int) -> None:
        for _ in range(loops):
            bench.restore(bench.save())

    return run
