"""The laws: what each costs the on-board computer in a tick."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from ...closed_loop import Rows, law_pointer
from ...controller import Controller
from ...flight.plan import Flight, FlightPlan
from ...flight.simulate import simulate
from ...laws import CompiledLaw
from ...laws import laws as all_laws
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
    rows: Rows
    signals: Array
    """(ticks, 4, m): e, edot, rhodd_d, N_hat of every tick."""

    @classmethod
    def of(cls, name: str, ticks: int) -> Recorded:
        """Fly ``ticks`` ticks."""
        flight = Flight(FlightPlan(controller=name, case=CASE))
        flight.ticks = ticks
        log = simulate(flight)
        controller = Controller(flight.robot, flight.controller.law, flight.period)
        controller.law.reset()
        signals = np.zeros((ticks, 4, log.axes))
        for tick in range(ticks):
            controller.update(log.state(tick), *log.reference(tick))
            seen = controller.signals
            signals[tick] = seen.error, seen.error_rate, seen.acceleration_desired, seen.n_hat
        return cls(controller, Rows.of(log), signals)

    def whole_tick(self) -> Competitor:
        """Signals, law and torque."""
        law, pointer = self._law()
        torque = np.zeros(law.memory.shape[1])
        period = self.controller.period
        return lambda ticks: controller_ticks(
            pointer, law.gain_matrix, law.memory, law.h_bar, law.uses_model,
            self.controller.block, self.rows, ticks, torque, period,
        )  # fmt: skip

    def equation(self) -> Competitor:
        """The law's equation alone."""
        law, pointer = self._law()
        signals, period = self.controller.signals, self.controller.period
        inertia, bias = signals.inertia.copy(), signals.bias.copy()
        return lambda ticks: law_ticks(
            pointer, law.gain_matrix, law.memory, self.signals, inertia, bias, ticks, period
        )

    def _law(self) -> tuple[CompiledLaw, Any]:
        law = self.controller.law
        assert isinstance(law, CompiledLaw)
        return law, law_pointer(type(law).kernel)


def laws(options: Options) -> list[Result]:
    """A controller's tick under each law, and each law's equation alone."""
    names = [REFERENCE, *(name for name in all_laws() if name != REFERENCE)]
    recorded = {name: Recorded.of(name, 100 if options.short else TICKS) for name in names}
    results = []
    for what, unit, parts in (
        ("tick", "us", {name: flown.whole_tick() for name, flown in recorded.items()}),
        ("equation", "ns", {name: flown.equation() for name, flown in recorded.items()}),
    ):
        options.progress(f"one {what} of each law")
        seconds = interleave(parts, options.batches(), batch_s=options.batch_s)
        for name in names:
            beside = (f"{REFERENCE}, {what}", seconds[REFERENCE]) if name != REFERENCE else None
            target = TICK_US.get(name) if what == "tick" else None
            results.append(Result.timed(f"{name}, {what}", unit, seconds[name], beside, target))
    return results
