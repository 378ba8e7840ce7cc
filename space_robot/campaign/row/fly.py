"""Flies runs of a campaign in this process, one or several together, and returns their rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import FlightError, InputError, SpaceRobotError

from ...analysis.own_metric import MetricError, of_mapping
from ...flight.batch import FlightBatch, batches
from ...flight.ending import FAILED, Ending
from ...flight.plan import Flight
from ...flight.simulate import simulate
from ..draws import Draws
from ..study import Study
from .measure import measure_row, needs_truth_only
from .row import REFUSED, Row, Task, Value


@dataclass(frozen=True)
class RowFlyer:
    """Flies any task of a campaign; it can be sent to other processes and machines."""

    text: str
    """The study as JSON: small to send, and hashable, so equal flyers share their draws."""
    where: str
    """Name of the study's file, for errors."""
    seed: int
    runs: int
    """Number of runs of the design."""

    @classmethod
    def of(cls, study: Study, seed: int, runs: int) -> RowFlyer:
        """Return the flyer of a campaign."""
        return cls(study.model_dump_json(by_alias=True), study.where, seed, runs)

    @property
    def study(self) -> Study:
        """The campaign's study."""
        return _loaded(self)[0]

    @property
    def draws(self) -> Draws:
        """The campaign's draws, computed once per process.

        Raises:
            InputError: an unknown variable; names its key.
        """
        return _loaded(self)[1]

    def __call__(self, task: Task) -> Row:
        """Fly a task and return its row, also after an error.

        Args:
            task: run and law.
        """
        vary: dict[str, Value] = {}
        try:
            vary = self.draws.values(task.run)
            return self.row_of(task, self.draws.flight(task.run, task.law))
        except Exception as error:  # a defect of this package must not end a campaign either
            return _unflown(task, vary, error)

    def together(self, tasks: Sequence[Task]) -> list[Row]:
        """Fly tasks and return their rows, in any order.

        Those that can share a batch fly in lanes; each row is the one of the task alone.
        """
        rows: list[Row] = []
        flights: list[Flight] = []
        flown: list[Task] = []
        for task in tasks:
            try:
                flights.append(self.draws.flight(task.run, task.law))
                flown.append(task)
            except Exception as error:
                rows.append(_unflown(task, self.draws.values(task.run), error))
        for group in batches(enumerate(flights)):
            numbers = [number for number, _ in group]
            if len(group) == 1:
                rows += [self(flown[k]) for k in numbers]
                continue
            try:
                rows += self._rows_of([flown[k] for k in numbers], [flights[k] for k in numbers])
            except Exception:  # of one of them, which tells it by itself
                rows += [self(flown[k]) for k in numbers]
        return rows

    def _rows_of(self, tasks: Sequence[Task], flights: Sequence[Flight]) -> list[Row]:
        """Fly flights that can share a batch."""
        is_brief = not self.study.metrics and needs_truth_only(self.study.require.values())
        batch = FlightBatch(flights).fly(is_brief=is_brief)
        return [
            self.row_of_log(tasks[flown.flight], flights[flown.flight], flown.ending, flown.log)
            for flown in batch
        ]

    def row_of(self, task: Task, flight: Flight) -> Row:
        """Fly a flight and return its row."""
        try:
            log, ending = simulate(flight), Ending.complete(flight.ticks, flight.period)
        except FlightError as error:
            if error.log is None:
                raise
            log, ending = error.log, Ending.early(error, flight.period)
        return self.row_of_log(task, flight, ending, log)

    def row_of_log(self, task: Task, flight: Flight, ending: Ending, log: FlightLog) -> Row:
        """Return the row of a flown flight, bit for bit equal to that of `row_of`.

        Args:
            task: run and law.
            flight: with its plant in the state at the end.
            ending: of the flight.
            log: of the whole flight.

        Raises:
            MetricError: an own metric's function raised an error, or returned no number.
        """
        row = Row(
            task, ending.outcome, ending.reason, ending.ended_at_s, self.draws.values(task.run)
        )
        if ending.error is None:
            study, own = self.study, of_mapping(self.study.metrics)
            row = replace(
                row, **measure_row(log, flight.ticks, study.require, own, study.pointing)._asdict()
            )
        return row.digested(flight.plant.truth.block.tobytes())


def _unflown(task: Task, vary: dict[str, Value], error: Exception) -> Row:
    """Return the row of a task that raised an error."""
    if isinstance(error, InputError) and not isinstance(error, MetricError):
        return Row(task, REFUSED, str(error), vary=vary).digested()
    if isinstance(error, SpaceRobotError):  # such as a mistake in a user's law
        return Row(task, FAILED, str(error), vary=vary).digested()
    return Row(task, FAILED, one_line_of(error), vary=vary).digested()


@dataclass(frozen=True)
class BatchFlyer:
    """Flies several tasks of a campaign at once, see `RowFlyer.together`."""

    flyer: RowFlyer

    def __call__(self, tasks: tuple[Task, ...]) -> list[Row]:
        """Fly the tasks and return their rows."""
        return [self.flyer(tasks[0])] if len(tasks) == 1 else self.flyer.together(tasks)


@lru_cache(maxsize=4)
def _loaded(flyer: RowFlyer) -> tuple[Study, Draws]:
    study = Study.model_validate_json(flyer.text).named(flyer.where)
    return study, Draws(study, flyer.seed, flyer.runs)
