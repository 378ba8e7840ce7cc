"""Scenario of each run of a campaign."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterable, Iterator
from functools import lru_cache
from typing import Any

from space_robot_msgs_py.errors import InputError

from ...api import Scenario
from ...flight.plan import Flight
from ..study import Law, Study
from .designs import DESIGNS, Blocks, Design, DesignPoint, Saltelli, noise_seed
from .distributions import Grid, Value
from .nominal import Nominal, Variation
from .paths import Path, value_at
from .variables import Variable, errors_at, read_variables

MOST_NOMINALS = 64
"""Size of the cache of nominal flights, used where options of the scenario are varied."""
MOST_RUNS_KEPT = 256
"""Size of the cache of drawn values: several laws fly each run, and rows hold the values."""

Drawn = Iterable[tuple[Variable, Value]]


class Draws:
    """Random draws of a campaign; each number depends only on seed, run and variable name."""

    def __init__(self, study: Study, seed: int, runs: int, check: bool = True) -> None:
        """Resolve all variables of the campaign.

        Args:
            study: the campaign's file.
            seed: of the campaign.
            runs: number of runs, counted from 0.
            check: check that every law can fly the extreme values of each variable.

        Raises:
            InputError: something cannot be flown or varied; names the key of ``vary``.
        """
        self.study, self.seed, self.runs = study, seed, runs
        self._nominals: dict[tuple[str, str], Nominal] = {}
        nominals = []
        for law in study.laws:
            with errors_at(f"{study.where}: law {law}"):
                nominals.append(self._nominal(law))
        self._variables = read_variables(study, nominals)
        self.names = [variable.name for variable in self._variables]
        """Names of all variables, in the file's order."""
        self._grids = {
            variable.name: variable.distribution.grid
            for variable in self._variables
            if isinstance(variable.distribution, Grid)
        }
        self._points = math.prod(map(len, self._grids.values()))
        self._design = self._made_design()
        self._drawn = lru_cache(MOST_RUNS_KEPT)(self._draw)
        if check:
            self._check_ends()

    @property
    def grid(self) -> dict[str, int]:
        """Number of values of each grid variable, by name."""
        return {name: len(values) for name, values in self._grids.items()}

    @property
    def blocks(self) -> Blocks | None:
        """Layout of the runs in Saltelli's design; None for other designs."""
        if self.study.design != "saltelli":
            return None
        return Blocks(self.runs // self._points, self.names)

    @property
    def needs_all_runs(self) -> bool:
        """True if the draws depend on the number of runs."""
        return self._design.needs_all_runs

    def values(self, run: int) -> dict[str, float | str]:
        """Return the drawn values of a run by variable name.

        They are factors of variables with ``relative``, and differences of those with ``offset``.
        """
        return {variable.name: _told(value) for variable, value in self._drawn(run)}

    def scenario(self, run: int, law: str) -> Scenario:
        """Return the scenario of a law in a run; the plant's noise is the same for all laws.

        Raises:
            InputError: there is no such run, or its values cannot be flown together.
        """
        nominal, variation = self._varied(law, self._drawn(run), self._noise_seed(run))
        return nominal.scenario_of(variation)

    def flight(self, run: int, law: str) -> Flight:
        """Return the checked flight of `scenario`; files are read once a law, not once a run.

        Raises:
            InputError: as there, or it cannot be flown.
        """
        nominal, variation = self._varied(law, self._drawn(run), self._noise_seed(run))
        return nominal.flight_of(variation)

    def nominal(self, law: str) -> Scenario:
        """Return the nominal scenario of a law."""
        return self._nominal(law).scenario

    def flights_of_options(self) -> Iterator[tuple[str, Flight]]:
        """Yield a description and the flight of each extreme value of each varied option."""
        for variable in self._variables:
            if variable.group == "scenario":
                for value in variable.distribution.ends:
                    flight = self._extreme(self.study.laws[0], variable, value).check()
                    yield f"{variable.name}: {_shown(value)}", flight

    def _place(self, run: int) -> DesignPoint:
        if not 0 <= run < self.runs:
            raise InputError(f"run {run}: this campaign has runs 0 to {self.runs - 1}")
        return DesignPoint(*divmod(run, self._points))

    def _noise_seed(self, run: int) -> int:
        place = self._place(run)
        # in Saltelli's design noise is one more variable, which is never taken from B alone
        of_b = isinstance(self._design, Saltelli) and place.point > len(self.names)
        return noise_seed(self.seed, 2 * place.draw + of_b)

    def _draw(self, run: int) -> list[tuple[Variable, Value]]:
        place = self._place(run)
        point, on_grid = place.point, {}
        for name, values in reversed(self._grids.items()):
            point, index = divmod(point, len(values))
            on_grid[name] = values[index]
        numbers = itertools.count()
        return [
            (
                own,
                on_grid[own.name]
                if own.name in on_grid
                else own.distribution.quantile(
                    self._design.uniform(place, own.name, next(numbers))
                ),
            )
            for own in self._variables
        ]

    def _varied(self, law: str, drawn: Drawn, seed: int) -> tuple[Nominal, Variation]:
        """Return the nominal flight with drawn options, and what the other values change in it."""
        nominal, options = self._nominal(law), {}
        for variable, value in drawn:
            if variable.group == "scenario":
                path = variable.paths[0]
                options[path[1]] = variable.distribution.on(value_at(nominal.tree, path), value)
        if options:
            nominal = self._nominal(law, options)
        changed: dict[Path, Any] = {}
        for variable, value in drawn:
            for path in variable.paths if variable.group != "scenario" else ():
                now = changed[path] if path in changed else value_at(nominal.tree, path)
                if now is None and variable.group == "gains":  # of other laws
                    continue
                changed[path] = variable.distribution.on(now, value)
        return nominal, nominal.variation(changed, seed)

    def _nominal(self, law: str, options: dict[str, Any] | None = None) -> Nominal:
        """Return the nominal flight of a law with some options drawn."""
        options = options or {}
        key = law, repr(sorted(options.items()))
        if key not in self._nominals:
            if len(self._nominals) >= MOST_NOMINALS:
                del self._nominals[next(reversed(self._nominals))]
            merged, (controller, gains) = {**self.study.scenario, **options}, Law.parse(law)
            if "=" in law:
                merged["gains"] = gains
            self._nominals[key] = Nominal(Scenario(**merged, controller=controller))
        return self._nominals[key]

    def _made_design(self) -> Design:
        where, name = self.study.where, self.study.design
        kind = DESIGNS[name]
        if kind is Saltelli:
            for variable in self._variables:
                if not variable.distribution.is_continuous:
                    raise InputError(
                        f"{where}: vary.{variable.key}: the design saltelli needs continuous "
                        "distributions, not lists of values"
                    )
            if not self.names:
                raise InputError(f"{where}: design: saltelli needs at least one variable")
            self._points = len(self.names) + 2
        if self.runs < 1 or self.runs % self._points:
            more = self._points * max(1, math.ceil(self.runs / self._points))
            what = "d + 2 runs of each row" if kind is Saltelli else "points of the grid"
            raise InputError(
                f"{where}: runs: a multiple of {self._points}, the {what}, was expected, got "
                f"{self.runs}: try {more}"
            )
        draws = self.runs // self._points
        if kind is Saltelli:
            return Saltelli(self.seed, draws, len(self.names))
        return kind(self.seed, draws)

    def _check_ends(self) -> None:
        """Check that the extreme values of each variable can be flown."""
        for variable in self._variables:
            if variable.is_always_consistent:
                continue
            where = f"{self.study.where}: vary.{variable.key}"
            of_law = variable.group in ("controller", "gains")
            for law in self.study.laws if of_law else self.study.laws[:1]:
                for value in variable.distribution.ends:
                    with errors_at(f"{where}: {variable.name} can be {_shown(value)}"):
                        self._extreme(law, variable, value).check()

    def _extreme(self, law: str, variable: Variable, value: Value) -> Scenario:
        seed = self._nominal(law).scenario.seed
        nominal, variation = self._varied(law, [(variable, value)], seed)
        return nominal.scenario_of(variation)


def _told(value: Value) -> float | str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else float(value)


def _shown(value: Value) -> str:
    return str(_told(value)) if isinstance(value, (str, bool)) else f"{value:g}"
