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
from .distributions import Design, DesignPoint, Grid, Value, noise_seed
from .nominal import Nominal, Variation
from .paths import Path, value_at
from .variables import Variable, errors_at, read_variables

MOST_NOMINALS = 64
"""Size of the cache of nominal flights, used where options of the scenario are varied."""
MOST_RUNS_KEPT = 256
"""Size of the cache of drawn values: several laws fly each run, and rows hold the values."""


class Draws:
    """Random draws of a campaign; each number depends only on seed, run and variable name."""

    def __init__(self, study: Study, seed: int, runs: int) -> None:
        """Resolve all variables of a campaign with some ``runs``, counted from 0."""
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
            variable.name: variable.distribution.values
            for variable in self._variables
            if isinstance(variable.distribution, Grid)
        }
        self._points = self._runs_per_draw()
        self._design = Design(study.design, seed, runs // self._points, len(self.names))
        self._drawn = lru_cache(MOST_RUNS_KEPT)(self._draw)

    @property
    def grid(self) -> dict[str, int]:
        """Number of values of each grid variable, by name."""
        return {name: len(values) for name, values in self._grids.items()}

    def values(self, run: int) -> dict[str, float | str]:
        """Return the drawn values of a run by variable name.

        They are factors of variables with ``relative``, and differences of those with ``offset``.
        """
        return {variable.name: _as_cell(value) for variable, value in self._drawn(run)}

    def scenario(self, run: int, law: str) -> Scenario:
        """Return the scenario of a law in a run; the plant's noise is the same for all laws."""
        nominal, variation = self._varied(law, self._drawn(run), self._noise_seed(run))
        return nominal.scenario_with(variation)

    def flight(self, run: int, law: str) -> Flight:
        """Return the checked flight of `scenario`; files are read once a law, not once a run."""
        nominal, variation = self._varied(law, self._drawn(run), self._noise_seed(run))
        return nominal.flight_with(variation)

    def nominal(self, law: str) -> Scenario:
        """Return the nominal scenario of a law."""
        return self._nominal(law).scenario

    def check_ends(self) -> None:
        """Check that every law can fly the extreme values of each variable."""
        for variable in self._variables:
            if variable.is_always_consistent:
                continue
            where = f"{self.study.where}: vary.{variable.key}: {variable.name} can be"
            differs_by_law = variable.group in ("controller", "gains")
            for law in self.study.laws if differs_by_law else self.study.laws[:1]:
                for value in variable.distribution.ends:
                    with errors_at(f"{where} {_as_text(value)}"):
                        self._extreme(law, variable, value).check()

    def option_flights(self) -> Iterator[tuple[str, Flight]]:
        """Yield a description and the flight of each extreme value of each varied option."""
        for variable in self._variables:
            if variable.group == "scenario":
                for value in variable.distribution.ends:
                    flight = self._extreme(self.study.laws[0], variable, value).check()
                    yield f"{variable.name}: {_as_text(value)}", flight

    def _extreme(self, law: str, variable: Variable, value: Value) -> Scenario:
        seed = self._nominal(law).scenario.seed
        nominal, variation = self._varied(law, [(variable, value)], seed)
        return nominal.scenario_with(variation)

    def _place(self, run: int) -> DesignPoint:
        if not 0 <= run < self.runs:
            raise InputError(f"run {run}: this campaign has runs 0 to {self.runs - 1}")
        return DesignPoint(*divmod(run, self._points))

    def _noise_seed(self, run: int) -> int:
        place = self._place(run)
        # in Saltelli's design noise is one more variable, which is never taken from B alone
        is_b = self.study.design == "saltelli" and place.point > len(self.names)
        return noise_seed(self.seed, 2 * place.draw + is_b)

    def _draw(self, run: int) -> list[tuple[Variable, Value]]:
        place = self._place(run)
        point, drawn = place.point, dict[str, Value]()
        for name, values in reversed(self._grids.items()):
            point, index = divmod(point, len(values))
            drawn[name] = values[index]
        numbers = itertools.count()
        for variable in self._variables:
            if variable.name not in self._grids:
                u = self._design.uniform(place, variable.name, next(numbers))
                drawn[variable.name] = variable.distribution.quantile(u)
        return [(variable, drawn[variable.name]) for variable in self._variables]

    def _varied(
        self, law: str, drawn: Iterable[tuple[Variable, Value]], seed: int
    ) -> tuple[Nominal, Variation]:
        nominal, options = self._nominal(law), {}
        for variable, value in drawn:
            if variable.group == "scenario":
                path = variable.paths[0]
                options[path[1]] = variable.distribution.on(value_at(nominal.tree, path), value)
        if options:
            axes, nominal = nominal.names.axes, self._nominal(law, options)
            if nominal.names.axes != axes and any(v.group == "gains" for v in self._variables):
                raise InputError(
                    "gains cannot be varied together with robots that have other joints"
                )
        changed: dict[Path, Any] = {}
        for variable, value in drawn:
            for path in variable.paths if variable.group != "scenario" else ():
                now = changed[path] if path in changed else value_at(nominal.tree, path)
                if now is None and variable.group == "gains":  # of other laws
                    continue
                changed[path] = variable.distribution.on(now, value)
        return nominal, nominal.variation(changed, seed)

    def _nominal(self, law: str, options: dict[str, Any] | None = None) -> Nominal:
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

    def _runs_per_draw(self) -> int:
        where, points = self.study.where, math.prod(self.grid.values())
        what = "points of the grid"
        if self.study.design == "saltelli":
            for variable in self._variables:
                if not variable.distribution.is_continuous:
                    raise InputError(
                        f"{where}: vary.{variable.key}: the design saltelli needs continuous "
                        "distributions, not lists of values"
                    )
            if not self.names:
                raise InputError(f"{where}: design: saltelli needs at least one variable")
            points, what = len(self.names) + 2, "d + 2 runs of each row"
        if self.runs < 1 or self.runs % points:
            more = points * max(1, math.ceil(self.runs / points))
            raise InputError(
                f"{where}: runs: a multiple of {points}, the {what}, was expected, got "
                f"{self.runs}: try {more}"
            )
        return points


def _as_cell(value: Value) -> float | str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else float(value)


def _as_text(value: Value) -> str:
    return str(_as_cell(value)) if isinstance(value, (str, bool)) else f"{value:g}"
