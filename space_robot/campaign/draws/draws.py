"""Scenario of each run of a campaign."""

from __future__ import annotations

import itertools
import math
from collections.abc import Iterator, Sequence
from typing import Any

from space_robot_msgs_py.errors import InputError

from ...api import Scenario
from ...flight.plan import Flight
from ..study import Law, Study
from .changes import Changes, Nominal
from .designs import DESIGNS, Blocks, Design, DesignPoint, Saltelli
from .distributions import Grid, Value
from .keys import noise_seed
from .setting_variables import OfScenario
from .variable import Variable
from .variables import told_at, variables_of

MOST_NOMINALS = 64
"""Size of the cache of nominal flights, used where options of the scenario are varied."""


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
        nominals = [self._nominal(law, {}) for law in study.laws]
        self._variables = variables_of(study, nominals)
        self._grids = [v for v in self._variables if isinstance(v.distribution, Grid)]
        self._drawn = [v for v in self._variables if not isinstance(v.distribution, Grid)]
        self.names = [variable.name for variable in self._variables]
        """Names of all variables, in the file's order."""
        self._points = math.prod(len(_values(v)) for v in self._grids)
        self._design = self._made_design()
        if check:
            self._check()

    @property
    def grid(self) -> dict[str, int]:
        """Number of values of each grid variable, by name."""
        return {variable.name: len(_values(variable)) for variable in self._grids}

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
        return {name: _told(value) for name, value in zip(self.names, self._raw(run), strict=True)}

    def scenario(self, run: int, law: str) -> Scenario:
        """Return the scenario of a law in a run; the plant's noise is the same for all laws.

        Raises:
            InputError: there is no such run, or its values cannot be flown together.
        """
        return self._drawn_changes(run, law).scenario(seed=self._noise_seed(run))

    def flight(self, run: int, law: str) -> Flight:
        """Return the checked flight of `scenario`; files are read once a law, not once a run.

        Raises:
            InputError: as there, or it cannot be flown.
        """
        return self._drawn_changes(run, law).flight(self._noise_seed(run))

    def _noise_seed(self, run: int) -> int:
        place = self._place(run)
        # in Saltelli's design noise is one more variable, which is never taken from B alone
        of_b = isinstance(self._design, Saltelli) and place.point > len(self.names)
        return noise_seed(self.seed, 2 * place.draw + of_b)

    def _drawn_changes(self, run: int, law: str) -> Changes:
        return self._changes(law, list(zip(self._variables, self._raw(run), strict=True)))

    def nominal(self, law: str) -> Scenario:
        """Return the nominal scenario of a law."""
        return self._nominal(law, {}).scenario

    def flights_of_options(self) -> Iterator[tuple[str, Flight]]:
        """Yield a description and the flight of each extreme value of each varied option."""
        for variable in self._variables:
            if isinstance(variable, OfScenario):
                for value in variable.distribution.ends:
                    changes = self._changes(self.study.laws[0], [(variable, value)])
                    yield f"{variable.name}: {_shown(value)}", changes.scenario().check()

    def _place(self, run: int) -> DesignPoint:
        if not 0 <= run < self.runs:
            raise InputError(f"run {run}: this campaign has runs 0 to {self.runs - 1}")
        return DesignPoint(*divmod(run, self._points))

    def _raw(self, run: int) -> list[Value]:
        place = self._place(run)
        point, of_grid = place.point, {}
        for variable in reversed(self._grids):
            values = _values(variable)
            point, index = divmod(point, len(values))
            of_grid[variable.name] = values[index]
        numbers = itertools.count()
        return [
            of_grid[v.name]
            if v.name in of_grid
            else v.distribution.quantile(self._design.uniform(place, v.name, next(numbers)))
            for v in self._variables
        ]

    def _changes(self, law: str, drawn: Sequence[tuple[Variable, Value]]) -> Changes:
        changes = Changes(self._nominal(law, {}))
        for variable, value in drawn:
            if isinstance(variable, OfScenario):
                variable.apply(value, changes)
        if changes.options and len(changes.options) < len(drawn):
            changes = changes.on(self._nominal(law, changes.options))
        for variable, value in drawn:
            if not isinstance(variable, OfScenario):
                variable.apply(value, changes)
        return changes

    def _nominal(self, law: str, options: dict[str, Any]) -> Nominal:
        """Return the nominal flight of a law with some options drawn."""
        key = law, repr(sorted(options.items()))
        if key not in self._nominals:
            if len(self._nominals) >= MOST_NOMINALS:
                del self._nominals[next(reversed(self._nominals))]
            merged, (controller, gains) = {**self.study.scenario, **options}, Law.parse(law)
            if "=" in law:
                merged["gains"] = gains
            try:
                self._nominals[key] = Nominal.of(Scenario(**merged, controller=controller))
            except InputError as error:
                raise InputError(f"{self.study.where}: law {law}: {error}") from None
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

    def _check(self) -> None:
        """Check that the extreme values of each variable can be flown."""
        for variable in self._variables:
            if variable.is_of_plant_robot:
                continue
            where = f"{self.study.where}: vary.{variable.key}"
            for law in self.study.laws if variable.is_of_law else self.study.laws[:1]:
                for value in variable.distribution.ends:
                    with told_at(f"{where}: {variable.name} can be {_shown(value)}"):
                        self._changes(law, [(variable, value)]).scenario().check()


def _values(variable: Variable) -> list[Any]:
    grid = variable.distribution
    assert isinstance(grid, Grid)
    return grid.grid


def _told(value: Value) -> float | str:
    if isinstance(value, bool):
        return str(value).lower()
    return value if isinstance(value, str) else float(value)


def _shown(value: Value) -> str:
    return str(_told(value)) if isinstance(value, (str, bool)) else f"{value:g}"
