"""All flights behind Table V, in parallel processes: each row under each variant."""

from __future__ import annotations

import multiprocessing
import os
from collections.abc import Callable, Iterator, Sequence
from concurrent.futures import Future, ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from space_robot_msgs_py.configuration import config_directory
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_msgs_py.validation import read_yaml

from ..analysis import analyse
from ..analysis.figures import control_results, save_figure
from ..flight.plan import Flight, FlightPlan
from ..flight.simulate import simulate
from .table_v import PRINTED

ROBOT = "paper"
DEFINITIONS = {"mean_axis": "mean of the axes' RMS", "eq64": "RMS by (64)"}


@dataclass(frozen=True)
class Variant:
    """What Table V leaves open: the gain set, and whether the joints rub."""

    gains: str
    friction: bool

    @property
    def title(self) -> str:
        """For a person."""
        return f"{self.gains} gains, {'printed friction' if self.friction else 'friction-free'}"


VARIANTS = tuple(Variant(g, f) for g in ("printed", "tuned") for f in (True, False))


@dataclass(frozen=True)
class Row:
    """A row of Table V."""

    controller: str
    case: str

    @classmethod
    def parse(cls, text: str) -> Row:
        """From ``CONTROLLER/CASE``.

        Raises:
            InputError: Table V has no such row.
        """
        row = cls(*text.partition("/")[::2])
        if (row.controller, row.case) not in PRINTED:
            names = ", ".join(f"{controller}/{case}" for controller, case in PRINTED)
            raise InputError(f"Table V has no row {text!r}: choose from {names}")
        return row

    @property
    def shown(self) -> Variant:
        """The variant that is drawn: the default gains, the printed friction."""
        sets = read_yaml(config_directory() / "gains" / ROBOT / "default_sets.yaml")
        return Variant(sets[self.controller], True)


ROWS = tuple(Row(controller, case) for controller, case in PRINTED)


@dataclass(frozen=True)
class Result:
    """A finished flight."""

    row: Row
    variant: Variant
    diverged_tick: int | None
    report: dict[str, Any] | None
    """Of `analyse`; None if the flight diverged."""
    log: FlightLog | None
    """Of the flight that is drawn in case 1, for comparisons."""


def fly(row: Row, variant: Variant, duration: float | None, folder: Path | None) -> Result:
    """Fly one row under one variant; the one that is shown is also drawn into ``folder``."""
    plan = FlightPlan(
        controller=row.controller, case=row.case, gains=variant.gains, robot=ROBOT,
        friction=variant.friction, duration=duration,
    )  # fmt: skip
    try:
        log = simulate(Flight(plan))
    except DivergedError as error:
        return Result(row, variant, error.tick, None, None)
    log.telemetry = log.commanded_torque = None  # not compared, and heavy to hand over
    shown = variant == row.shown
    if shown and folder is not None:
        title = f"{row.controller}, case {row.case}: {variant.title}"
        stem = folder / f"case{row.case}_{row.controller}"
        save_figure(control_results(log, title), stem)
    return Result(row, variant, None, analyse(log), log if shown and row.case == "1" else None)


@contextmanager
def flights(
    rows: Sequence[Row], duration: float | None, folder: Path | None, jobs: int
) -> Iterator[list[Future[Result]]]:
    """Start every row under every variant in ``jobs`` processes; yields the futures.

    The processes are forked, and forked at once: they inherit the compiled kernels.
    """
    context = multiprocessing.get_context("fork")
    with ProcessPoolExecutor(jobs, mp_context=context) as pool:
        futures = [
            pool.submit(fly, row, variant, duration, folder)
            for row in rows
            for variant in VARIANTS
        ]  # fmt: skip
        try:
            yield futures
        except BaseException:
            pool.shutdown(wait=False, cancel_futures=True)
            raise


def collect(futures: list[Future[Result]], progress: Callable[[], None]) -> list[Result]:
    """The results in the order of the flights; ``progress`` is called as each is done."""
    for future in as_completed(futures):
        future.result()
        progress()
    return [future.result() for future in futures]


def cores() -> int:
    """Processors that this process may use."""
    return len(os.sched_getaffinity(0))
