"""Flies runs of a campaign in this process, one or several in lanes, and returns their rows."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import lru_cache, partial

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from ...analysis.own_metric import MetricError, listed_metrics
from ...flight.batch import batches, fly_group
from ...flight.ending import FAILED, Ending
from ...flight.plan import Flight
from ...gpu.device import DeviceError
from ...gpu.fly import MOST_FLIGHTS, device_named, fly_on_device
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
    device: str = "cpu"
    """Where batches fly: ``cpu`` or ``gpu``."""

    @classmethod
    def of(cls, study: Study, seed: int, runs: int, device: str = "cpu") -> RowFlyer:
        """Return the flyer of a campaign."""
        return cls(study.model_dump_json(by_alias=True), study.where, seed, runs, device)

    @property
    def study(self) -> Study:
        """The campaign's study."""
        return self.draws.study

    @property
    def draws(self) -> Draws:
        """The campaign's draws, resolved once per process; their ends have not been checked."""
        return _resolved_draws(self)

    def __call__(self, task: Task) -> Row:
        """Fly a task and return its row, also after an error."""
        vary: dict[str, Value] = {}
        try:
            vary = self.draws.values(task.run)
            flight = self.draws.flight(task.run, task.law)
            (flown,) = fly_group([flight])
            return self.measured_row(task, flight, flown.ending, flown.log)
        except Exception as error:  # a defect of this package must not end a campaign either
            return _unflown(task, vary, error)

    def fly_batch(self, tasks: Sequence[Task]) -> list[Row]:
        """Fly tasks and return their rows, in any order.

        Those that can share a batch fly in lanes, or on the device; each row is the one of the
        task alone.

        Raises:
            DeviceError: the device has failed.
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
        study = self.study
        is_brief = not study.metrics and needs_truth_only(flights, study.require.values())
        device = device_named(self.device)
        fly = fly_group if device is None else partial(fly_on_device, device=device)
        for group in batches(enumerate(flights), MOST_FLIGHTS if device else WIDTH):
            numbers = [number for number, _ in group]
            if len(group) > 1:
                try:
                    sharing = [flight for _, flight in group]
                    rows += [
                        self.measured_row(flown[numbers[k]], sharing[k], ending, log)
                        for k, log, ending in fly(sharing, is_brief=is_brief)
                    ]
                    continue
                except DeviceError:
                    raise
                except Exception:
                    pass  # of one of them, whose own row says it
            rows += [self(flown[k]) for k in numbers]
        return rows

    def measured_row(self, task: Task, flight: Flight, ending: Ending, log: FlightLog) -> Row:
        """Return the row of a flown flight, whose plant is in the state at the end.

        Raises:
            MetricError: an own metric's function raised an error, or returned no number.
        """
        vary = self.draws.values(task.run)
        row = Row(task, ending.outcome, ending.reason, ending.ended_at_s, vary)
        if ending.error is None:
            study, own = self.study, listed_metrics(self.study.metrics)
            measured = measure_row(log, flight.ticks, study.require, own, study.pointing)
            row = replace(row, **measured._asdict())
        return row.digested(flight.plant.truth.block.tobytes())


def _unflown(task: Task, vary: dict[str, Value], error: Exception) -> Row:
    if isinstance(error, InputError) and not isinstance(error, MetricError):
        return Row(task, REFUSED, str(error), vary=vary).digested()
    # an error of this project, such as of a mistake in a user's law, names its place itself
    text = str(error) if isinstance(error, SpaceRobotError) else one_line_of(error)
    return Row(task, FAILED, text, vary=vary).digested()


@dataclass(frozen=True)
class BatchFlyer:
    """Flies several tasks of a campaign at once, see `RowFlyer.fly_batch`."""

    flyer: RowFlyer

    def __call__(self, tasks: tuple[Task, ...]) -> list[Row]:
        """Fly the tasks and return their rows."""
        return [self.flyer(tasks[0])] if len(tasks) == 1 else self.flyer.fly_batch(tasks)


@lru_cache(maxsize=4)
def _resolved_draws(flyer: RowFlyer) -> Draws:
    study = Study.model_validate_json(flyer.text).named(flyer.where)
    return Draws(study, flyer.seed, flyer.runs)
