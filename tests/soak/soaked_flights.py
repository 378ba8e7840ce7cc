"""Random flights flown one after the other, and the report on them."""

from __future__ import annotations

import io
import itertools
import shutil
import tempfile
import time
from collections import Counter
from collections.abc import Callable, Sequence
from contextlib import redirect_stderr, suppress
from dataclasses import asdict, dataclass, field
from pathlib import Path
from typing import Any

import psutil
from flight_verdict import FlightVerdict, judge
from process_monitor import ProcessMonitor, shared_memory_files
from random_flights import breaks_tracking, command_line, sample_flight

from space_robot.analysis import analyze
from space_robot.flight.compilation import compile_kernels
from space_robot.flight.graph.following import InterruptedFlightError
from space_robot.flight.graph.orchestrator import fly
from space_robot.flight.graph.processes import begin_loading
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.processes.interruption import Interrupted
from space_robot_msgs_py.errors import SpaceRobotError

WARM_UP = 3
"""Flights after which this process should have what it needs."""


@dataclass
class SoakedFlight:
    """A flight of a soak."""

    number: int
    plan: FlightPlan
    seconds: float
    """By the wall clock, start-up and judgement included."""
    verdict: FlightVerdict
    memory_mb: dict[str, float]
    """Largest resident set of each node."""
    own_memory_mb: float
    """Resident set of this process after the flight."""
    bag: Path | None
    """None: deleted."""

    def record(self) -> dict[str, Any]:
        """Return the flight as JSON has it."""
        plan = self.plan
        return {
            "number": self.number,
            "controller": plan.controller,
            "case": plan.case,
            "swaps": plan.swaps,
            "faults": plan.faults,
            "seed": plan.seed,
            "command": command_line(plan),
            "breaks_tracking": breaks_tracking(plan),
            "survived": self.verdict.survived,
            **asdict(self.verdict),
            "seconds": self.seconds,
            "memory_mb": self.memory_mb,
            "own_memory_mb": self.own_memory_mb,
            "bag": str(self.bag) if self.bag else None,
        }

    def line(self) -> str:
        """Return the line that people see while the soak goes on."""
        why = "; ".join(wrong.splitlines()[0] for wrong in self.verdict.wrong)
        how = "survived" if self.verdict.survived else f"FAILED: {why}"
        plan = self.plan
        events = " ".join([*(f"swap@{swap}" for swap in plan.swaps), *plan.faults])
        return (
            f"{self.number:4d}  {plan.controller}, case {plan.case}, {events}: {how} "
            f"({self.seconds:.1f} s)"
        )


@dataclass
class Soak:
    """The flights of a soak, and what they left behind."""

    seed: int
    flights: list[SoakedFlight] = field(default_factory=list)
    interrupted_by: int = 0
    """Signal that ended it; 0: its time was over."""
    shared_memory_files: tuple[int, int] = (0, 0)
    """Files of Fast DDS, at the start and at the end."""

    def report(self) -> dict[str, Any]:
        """Return everything, for JSON and for the table."""
        kinds = Counter(f.partition("@")[0] for flown in self.flights for f in flown.plan.faults)
        calm = [flown for flown in self.flights if not breaks_tracking(flown.plan)]
        disturbed = [flown for flown in self.flights if breaks_tracking(flown.plan)]
        own = [flown.own_memory_mb for flown in self.flights]
        return {
            "seed": self.seed,
            "interrupted": self.interrupted_by != 0,
            "flights": len(self.flights),
            "survived": sum(flown.verdict.survived for flown in self.flights),
            "faults": kinds.total(),
            "faults_by_kind": dict(sorted(kinds.items())),
            "restarts": sum(flown.verdict.restarts for flown in self.flights),
            "messages_lost": sum(flown.verdict.lost for flown in self.flights),
            "largest_error": {"tracking": _largest(calm), "disturbed": _largest(disturbed)},
            "memory_growth_mb": {
                "soak": own[-1] - own[WARM_UP - 1] if len(own) > WARM_UP else None,
                "largest_node": _growth(
                    [max(f.memory_mb.values(), default=0.0) for f in self.flights]
                ),
            },
            "shared_memory_files": dict(
                zip(("start", "end"), self.shared_memory_files, strict=True)
            ),
            "each": [flown.record() for flown in self.flights],
        }


def soak(
    seconds: float, seed: int, duration_s: float, bags: Path | None, say: Callable[[str], None]
) -> Soak:
    """Fly until a time is over; the flight then under way comes to its end. SIGINT ends it at once.

    Args:
        seconds: of the wall clock.
        seed: of the flights, see `sample_flight`.
        duration_s: of each flight, simulated.
        bags: a new folder that keeps all bags; None: those of failed flights are kept below the
            system's folder for temporary files.
        say: told a line a flight.
    """
    if bags:
        bags.mkdir(parents=True)
    folder = bags or Path(tempfile.mkdtemp(prefix="space_robot_soak_"))
    done, at_start = Soak(seed), shared_memory_files()
    try:
        compile_kernels(with_allocation=True)
        begin_loading()  # one server forks the nodes of all flights: it is not left behind by one
        until = time.monotonic() + seconds
        for number in itertools.count(1):
            if time.monotonic() >= until:
                break
            bag = folder / f"flight_{number:04d}"
            done.flights.append(_fly(number, sample_flight(seed, number, duration_s), bag, bags))
            say(done.flights[-1].line())
    except (InterruptedFlightError, Interrupted) as ended:
        done.interrupted_by = ended.number
        if not bags:
            shutil.rmtree(folder / f"flight_{len(done.flights) + 1:04d}", ignore_errors=True)
    finally:
        with suppress(OSError):
            folder.rmdir()  # if nothing is in it
    done.shared_memory_files = at_start, shared_memory_files()
    return done


def _fly(number: int, plan: FlightPlan, bag: Path, bags: Path | None) -> SoakedFlight:
    begin = time.monotonic()
    flight = Flight(resolve(plan))
    report, wrong = None, []
    with (
        ProcessMonitor() as process_monitor,
        redirect_stderr(io.StringIO()),
    ):  # the flight's own progress
        try:
            report = fly(flight, bag, analyze)
        except InterruptedFlightError:
            raise
        except SpaceRobotError as error:
            wrong.append(str(error))
        except Exception as error:  # a bug in the flight software must not end the soak
            wrong.append(f"{type(error).__name__}: {error}")
    verdict = judge(flight, report, bag)
    verdict.wrong[:0] = wrong
    verdict.wrong += [f"left behind: {process}" for process in process_monitor.left_behind]
    if verdict.survived and not bags:
        shutil.rmtree(bag)
    return SoakedFlight(
        number,
        plan,
        time.monotonic() - begin,
        verdict,
        process_monitor.peak_mb,
        psutil.Process().memory_info().rss / 1e6,
        bag if bag.exists() else None,
    )


def _largest(flights: Sequence[SoakedFlight]) -> dict[str, dict[str, float] | None]:
    """Return the largest attitude and joint error, each with the number of its flight.

    None stands for an error that no bag tells.
    """
    largest: dict[str, dict[str, float] | None] = {}
    for name in ("attitude", "joint"):
        errors = [
            (error, flown.number)
            for flown in flights
            if (error := getattr(flown.verdict, f"{name}_error")) is not None
        ]
        error, number = max(errors, default=(None, 0))
        largest[name] = None if error is None else {"value": error, "flight": number}
    return largest


def _growth(peaks: Sequence[float]) -> float | None:
    """Return the growth from the first to the last quarter's largest; None: too few flights."""
    quarter = len(peaks) // 4
    return max(peaks[-quarter:]) - max(peaks[:quarter]) if quarter else None
