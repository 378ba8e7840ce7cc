"""The laws: what each costs the on-board computer in a tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.controller import Controller
from space_robot_control.flight.closed_loop import Rows, law_pointer
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import simulate
from space_robot_control.laws import CompiledLaw
from space_robot_control.laws import laws as all_laws

from ..kernels import controller_ticks, law_ticks
from ..measure import Competitor, Options, interleave
from ..result import Result, Target
from .plant import CASE

Array = NDArray[np.float64]

REFERENCE = "ctc"
"""The law that the others stand beside."""
TICK_US = {"tde_stc": Target(1.0)}
"""Asked of a controller's tick, us."""
TICKS = 2000


@dataclass(frozen=True)
class Recorded:
    """A flight of case 3 under one law, and a controller to run over its rows again."""

    controller: Controller
    """As before the first tick."""
    rows: Rows
    signals: Array
    """(ticks, 4, m): e, edot, rhodd_d, N_hat of every tick."""
    inertia: Array
    """H_S of the last tick, if the law uses it."""
    bias: Array
    """c_S, likewise."""

    @classmethod
    def of(cls, name: str, ticks: int) -> Recorded:
        """Fly ``ticks`` ticks."""
        flight = Flight(FlightPlan(controller=name, case=CASE))
        flight.ticks = ticks
        log = simulate(flight)
        law, period = flight.controller.law, flight.period
        controller = Controller(flight.robot, law, period)
        signals, seen = np.zeros((ticks, 4, log.axes)), controller.signals
        for tick in range(ticks):
            controller.update(log.state(tick), *log.reference(tick))
            signals[tick] = seen.error, seen.error_rate, seen.acceleration_desired, seen.n_hat
        fresh = Controller(flight.robot, law, period)
        return cls(fresh, Rows.of(log), signals, seen.inertia.copy(), seen.bias.copy())

    def whole_tick(self) -> tuple[Competitor, Array]:
        """Signals, law and torque; and the array (m,) the torque is written into."""
        law, pointer = self._law()
        torque, period = np.zeros(law.memory.shape[1]), self.controller.period
        return lambda ticks: controller_ticks(
            pointer, law.gain_matrix, law.memory, law.h_bar, law.uses_model,
            self.controller.block, self.rows, ticks, torque, period,
        ), torque  # fmt: skip

    def equation(self) -> Competitor:
        """The law's equation alone."""
        law, pointer = self._law()
        return lambda ticks: law_ticks(
            pointer, law.gain_matrix, law.memory, self.signals, self.inertia, self.bias, ticks,
            self.controller.period,
        )  # fmt: skip

    def _law(self) -> tuple[CompiledLaw, Any]:
        law = self.controller.law
        assert isinstance(law, CompiledLaw)
        return law, law_pointer(type(law).kernel)


def laws(options: Options) -> list[Result]:
    """A controller's tick under each law, and each law's equation alone."""
    names = [REFERENCE, *(name for name in all_laws() if name != REFERENCE)]
    recorded = {name: Recorded.of(name, 100 if options.short else TICKS) for name in names}
    results = []
    ticks = {name: flown.whole_tick()[0] for name, flown in recorded.items()}
    equations = {name: flown.equation() for name, flown in recorded.items()}
    for what, unit, parts in (("tick", "us", ticks), ("equation", "ns", equations)):
        options.progress(f"one {what} of each law")
        seconds = interleave(parts, options.batches(), batch_s=options.batch_s)
        for name in names:
            beside = (f"{REFERENCE}, {what}", seconds[REFERENCE]) if name != REFERENCE else None
            target = TICK_US.get(name) if what == "tick" else None
            results.append(Result.timed(f"{name}, {what}", unit, seconds[name], beside, target))
    return results
