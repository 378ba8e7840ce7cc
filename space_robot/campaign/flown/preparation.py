"""Preparation of a campaign: checks before its first flight, and the manifest of its folder."""

from __future__ import annotations

from contextlib import closing
from dataclasses import dataclass
from functools import cached_property

from space_robot_msgs_py.config.arguments import as_whole_number
from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.errors import FlightError, InputError

from ...analysis.own_metric import check_names, listed_metrics, metric_function
from ...flight.batch import batch_obstacle
from ...flight.compilation import compile_kernels, compile_lanes
from ...flight.plan import Flight
from ...flight.simulate import simulate
from ...gpu.fly import device_named
from ...processes.executor import run_many
from ...processes.software import commit
from ..row.fly import RowFlyer
from ..row.measure import check_requirements, planned, row_columns, row_metrics
from ..row.row import Columns
from ..study import Study
from .manifest import Manifest, file_digests, flight_digest, software

ACTUATORS = "actuators"
"""End of the name of a variable that selects the base's actuators."""


@dataclass(frozen=True)
class Preparation:
    """A study with its seed and the number of its runs."""

    study: Study
    seed: int
    runs: int
    device: str = "cpu"

    @classmethod
    def of(cls, study: Study, seed: int, runs: int | None, device: str = "cpu") -> Preparation:
        """Check seed and number of runs; ``runs`` None: from the file."""
        as_whole_number(seed, "seed", 0)
        if runs is not None:
            as_whole_number(runs, "runs", 1)
        asked = study.runs_asked(runs)
        device_named(device)
        runs = min(asked, study.until.runs) if study.until else asked
        return cls(study, seed, runs, device)

    @cached_property
    def flyer(self) -> RowFlyer:
        """Flies each task of the campaign."""
        return RowFlyer.of(self.study, self.seed, self.runs, self.device)

    @cached_property
    def flights(self) -> dict[str, Flight]:
        """The nominal flight of each law."""
        draws = self.flyer.draws
        draws.check_ends()
        return {law: draws.nominal(law).check() for law in self.study.laws}

    @cached_property
    def manifest(self) -> Manifest:
        """Manifest of the campaign's folder."""
        where, own, budget = self.study.where, self.study.metrics, self.study.pointing
        require, key = self.study.require, f"{where}: require"
        flights = self.flights.values()  # before metrics: what is wrong with a law is said first
        try:  # they have columns of their own
            check_names(own)
            for text in own.values():
                metric_function(text)
        except InputError as error:
            raise InputError(f"{where}: metrics: {error}") from None
        for flight in flights:
            check_requirements(flight, require, key, own=own, budget=budget)
        if require:
            for option, flight in self.flyer.draws.option_flights():
                check_requirements(flight, require, key, option, own, budget)
        study = self.study.content
        return Manifest(
            seed=self.seed,
            runs=self.runs,
            study=study,
            software=software(),
            commit=commit(),
            files=file_digests(study),
            flights={law: flight_digest(flight) for law, flight in self.flights.items()},
            table=self._columns(),
        )

    @property
    def notes(self) -> list[str]:
        """A line for each law whose flights cannot be flown eight at a time."""
        reasons = {law: batch_obstacle(flight) for law, flight in self.flights.items()}
        return [f"{law}: flown one by one: {why}" for law, why in reasons.items() if why]

    def try_metrics(self, workers: int, timeout_s: float | None) -> None:
        """Fly the nominal flight of the first law, and evaluate the user's own metrics of it.

        A flight that ends early has no metrics, and is left to its rows. It flies in a worker if
        there are some, since a function may hold or end its process.
        """
        law, where = self.study.laws[0], self.study.where
        tried = run_many(self._measure_nominal, [law], workers=min(workers, 1), timeout_s=timeout_s)
        with closing(tried):
            for done in tried:
                if done.error is not None and not isinstance(done.error, InputError):
                    names = ", ".join(self.study.metrics)
                    why = printable(str(done.error))  # of the worker: died, too late, interrupted
                    raise InputError(
                        f"{where}: metrics {names}: {why}, with the nominal flight of {law}"
                    ) from None
                done.value()

    def _measure_nominal(self, law: str) -> None:
        where = self.study.where
        try:
            log = simulate(self.flyer.draws.nominal(law).check())
        except FlightError:
            return
        for metric in listed_metrics(self.study.metrics):
            try:
                metric.finite_value(log)
            except InputError as error:
                raise InputError(f"{where}: {error}, of the nominal flight of {law}") from None

    def compile(self, is_in_lanes: bool) -> None:
        """Compile the kernels once, before several processes need them.

        ``is_in_lanes``: flights may fly eight at a time; kernels for it are compiled if any can.
        """
        has_hardware = any(flight.plant.names.actuators for flight in self.flights.values())
        is_varied = any(name.endswith(ACTUATORS) for name in self.flyer.draws.names)
        compile_kernels(has_hardware or is_varied)
        if is_in_lanes and not all(map(batch_obstacle, self.flights.values())):
            compile_lanes()

    def _columns(self) -> Columns:
        nominal = next(iter(self.flights.values()))
        flight, draws = planned(nominal, self.study.pointing), self.flyer.draws
        first, own = draws.values(0), self.study.metrics
        metrics = row_metrics(flight, self.study.require.values())
        return Columns(
            vary={n: "str" if isinstance(first[n], str) else "float64" for n in draws.names},
            grid=draws.grid,
            metrics=[*(name for name in metrics if name not in own), *own],
            require=list(self.study.require),
            bands=row_columns(flight),
        )
