"""The laws: what each costs the on-board computer in a tick."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from numpy.typing import NDArray

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.controller.controller import Controller
from space_robot_control.laws import CompiledLaw, Signals
from space_robot_control.laws import laws as all_laws
from space_robot_control.laws.compiled import LawCode
from space_robot_msgs_py.compiled.records import Block

from ..kernels import controller_ticks, law_ticks
from ..measure import Competitor, Options, interleave
from ..result import Result, Target
from .lanes import time_ticks
from .plant import CASE

Array = NDArray[np.float64]

REFERENCE = "ctc"
"""The law that the others stand beside."""
TICK_US = {"tde_stc": Target(1.0)}
"""Asked of a controller's tick, us."""
TICKS = 2000
SIGNALS = 20


@dataclass(frozen=True)
class Recorded:
    """A flight of case 3 under one law, and a controller to run over its rows again."""

    controller: Controller
    """As before the first tick."""
    states: Block
    """(ticks,) `State` of every tick."""
    references: Block
    """(ticks,) `Reference` of every tick."""
    signals: Block
    """(`SIGNALS`,) `Signals` of the last ticks, which stay in the processor's cache."""

    @classmethod
    def of(cls, name: str, ticks: int) -> Recorded:
        """Fly ``ticks`` ticks."""
        flight = Flight(resolve(FlightPlan(controller=name, case=CASE)))
        flight.ticks = ticks
        log = simulate(flight)
        law, period = flight.controller.law, flight.period
        controller = Controller(flight.robot, law, period)
        states = np.concatenate([state.block for state in log.states(0, ticks)])
        references, signals = (
            log.references(0, ticks),
            np.zeros(SIGNALS, Signals.dtype(log.axes - 3)),
        )
        for tick in range(ticks):
            controller.update(log.state(tick), references[tick : tick + 1])
            signals[tick % SIGNALS] = controller.block["signals"][0]
        return cls(Controller(flight.robot, law, period), states, references, signals)

    def whole_tick(self) -> tuple[Competitor, Array]:
        """Signals, law and torque; and the array (m,) the torque is written into."""
        law = self._law()
        torque, period = np.zeros_like(law.memory[0].force), self.controller.period
        return lambda ticks: controller_ticks(
            law,
            self.controller.allocate,
            self.controller.block,
            self.states,
            self.references,
            ticks,
            torque,
            period,
        ), torque

    def equation(self) -> Competitor:
        """The law's equation alone."""
        law = self._law()
        return lambda ticks: law_ticks(law, self.signals, ticks, self.controller.period)

    def _law(self) -> LawCode:
        law = self.controller.law
        assert isinstance(law, CompiledLaw)
        return law.code


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
    return results + _flights(options, names)


def _flights(options: Options, names: list[str]) -> list[Result]:
    """Whole flights behind sensors and navigation, a tick of each, alone and eight in lanes."""
    flight = {"sensors": "fine", "navigation": "filtered", "gains": "robust"}
    duration = 0.05 if options.short else 0.5

    def some(name: str, count: int) -> list[Flight]:
        plan = FlightPlan.model_validate({"controller": name, "duration": duration, **flight})
        return [Flight(resolve(plan)) for _ in range(count)]

    alone: dict[str, list[float]] = {name: [] for name in names}
    in_lanes: dict[str, list[float]] = {name: [] for name in names}
    options.progress("whole flights under each law")
    for _ in range(options.batches(usual=5)):
        for name in names:
            seconds = time_ticks(partial(some, name))
            alone[name].append(seconds["alone"])
            in_lanes[name].append(seconds["lanes"])
    return [
        Result.timed(f"{name}, flight in lanes", "us", in_lanes[name], ("alone", alone[name]))
        for name in names
    ]
