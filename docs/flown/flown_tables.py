"""Tables and numbers of pages that are flown, and the files that keep what was flown.

A page has its definition here in `docs/flown`: `NAME.py` with a `PAGE`. Its tables stand in the
page between ``<!-- table NAME -->`` and ``<!-- end -->``; a `Sentence` stands anywhere in its text.
What the flights gave is kept in `NAME.json`, so a page can be compared with it without flying.

A kept flight is stale if its settings (all parameters, gains and files behind its options) are not
those of today, or if its first `BEGINNING_S` are not flown with the same torques: that shows most
changes of laws, noise, dynamics and allocation, too. What changes later in a flight is seen by
``python docs/flown --all`` only, which is part of a release.
"""

from __future__ import annotations

import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from space_robot import Scenario
from space_robot.api.flown_flight import FlownFlight
from space_robot.campaign.flown.manifest import flight_digest

DOCS = Path(__file__).parents[1]
BEGINNING_S = 0.1
SAME = 1e-3
"""Relative to the largest of the torques: so much may switching laws make of a last bit."""
NUMBER = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?|-)"
Quantity = str | Callable[[FlownFlight], float]
"""Name of a metric, path of another number in `FlownFlight.report`, or what computes it."""
Options = Mapping[str, Any]
"""Of a `Scenario`."""
Kept = dict[str, dict[str, Any]]
"""What was flown: settings, beginning and numbers by the `key` of the options."""


class Number(NamedTuple):
    """A number of a flight, as a page shows it."""

    options: Options
    quantity: Quantity
    form: str = ".2g"
    """Python's format."""
    scale: float = 1.0

    def text(self, kept: Kept) -> str:
        """Write it; ``-`` where the flight has no such number."""
        value = kept[key(self.options)]["numbers"][quantity_name(self.quantity)]
        if value is None:
            return "-"
        return re.sub(r"e([+-])0*(\d)", _exponent, format(self.scale * value, self.form))


class Text(NamedTuple):
    """Text with a ``{}`` for each of some numbers."""

    template: str
    numbers: tuple[Number, ...]

    def text(self, kept: Kept) -> str:
        """Write it."""
        return self.template.format(*(number.text(kept) for number in self.numbers))


Cell = str | Number | Text


class Table(NamedTuple):
    """A table of a page, row by row."""

    name: str
    head: Sequence[str]
    rows: Sequence[Sequence[Cell]]

    def numbers(self) -> Iterator[Number]:
        """All numbers in it."""
        for cell in (cell for row in self.rows for cell in row):
            if isinstance(cell, Text):
                yield from cell.numbers
            elif isinstance(cell, Number):
                yield cell

    def put_into(self, page: str, kept: Kept) -> str:
        """Return the page with this table.

        Raises:
            ValueError: it has no place for it.
        """
        rows = [[c if isinstance(c, str) else c.text(kept) for c in row] for row in self.rows]
        lines = [f"| {' | '.join(row)} |".replace("|  |", "| |") for row in (self.head, *rows)]
        lines.insert(1, "|---" * len(self.head) + "|")
        place = re.compile(
            rf"(<!-- table {re.escape(self.name)} -->\n\n).*?(\n\n<!-- end -->)", re.S
        )
        if len(place.findall(page)) != 1:
            raise ValueError(f"no place, or more than one, for the table {self.name!r}")
        return place.sub(lambda found: f"{found[1]}{chr(10).join(lines)}{found[2]}", page)


class Sentence(NamedTuple):
    """Words that stand once in a page, with numbers of flights in them as ``{}``."""

    template: str
    numbers_: tuple[Number, ...]

    def numbers(self) -> Iterator[Number]:
        """All numbers in it."""
        yield from self.numbers_

    def put_into(self, page: str, kept: Kept) -> str:
        """Return the page with these numbers; breaks of lines stay where they are.

        Raises:
            ValueError: the words are not in the page, or more than once.
        """
        words = (re.escape(part).replace(r"\ ", r"\s+") for part in self.template.split("{}"))
        found = list(re.finditer(NUMBER.join(words), page))
        if len(found) != 1:
            raise ValueError(f"{len(found)} times in the page: {self.template!r}")
        for group in range(len(self.numbers_), 0, -1):
            start, stop = found[0].span(group)
            page = f"{page[:start]}{self.numbers_[group - 1].text(kept)}{page[stop:]}"
        return page


class Page(NamedTuple):
    """What of a page is flown."""

    name: str
    """Of its definition and of the file of what was flown."""
    path: str
    """Of the page, from docs/."""
    parts: Sequence[Table | Sentence]

    @property
    def file(self) -> Path:
        """Where what was flown is kept."""
        return Path(__file__).with_name(f"{self.name}.json")

    def flights(self) -> dict[str, tuple[Options, list[Quantity]]]:
        """Return the options of each flight, and the quantities wanted of it, by `key`."""
        flights: dict[str, tuple[Options, list[Quantity]]] = {}
        for number in (number for part in self.parts for number in part.numbers()):
            _, quantities = flights.setdefault(key(number.options), (number.options, []))
            quantities += [] if number.quantity in quantities else [number.quantity]
        return flights

    def kept(self) -> Kept:
        """Read what was flown."""
        kept: Kept = json.loads(self.file.read_text("utf-8")) if self.file.exists() else {}
        return kept

    def stale(self) -> list[str]:
        """Return the keys of flights that are not kept, or would not be flown so today."""
        kept = self.kept()
        return [
            name
            for name, (options, quantities) in self.flights().items()
            if name not in kept
            or not {quantity_name(q) for q in quantities} <= kept[name]["numbers"].keys()
            or not is_same(kept[name], options)
        ]

    def fly(self, names: Iterable[str]) -> None:
        """Fly some flights again, and keep what they give; forget those that the page has not."""
        flights, kept = self.flights(), self.kept()
        kept = {name: kept[name] for name in flights if name in kept}
        for name in names:
            options, quantities = flights[name]
            numbers = fly(options, quantities)
            beginning = [float(f"{value:.6g}") for value in torques(options)]
            kept[name] = {"settings": settings(options), "beginning": beginning, "numbers": numbers}
            ordered = {key: kept[key] for key in sorted(kept)}
            self.file.write_text(json.dumps(ordered, indent=1) + "\n", "utf-8")

    def written(self) -> str:
        """Return the page's text with what was flown.

        Raises:
            ValueError: a table or sentence has no place in it.
        """
        page, kept = (DOCS / self.path).read_text("utf-8"), self.kept()
        for part in self.parts:
            page = part.put_into(page, kept)
        return page


def pages() -> dict[str, Page]:
    """Return all pages that are flown, by the names of their definitions."""
    names = sorted(path.stem for path in Path(__file__).parent.glob("[!_]*.py"))
    modules = {name: import_module(name) for name in names if name != Path(__file__).stem}
    return {name: module.PAGE for name, module in modules.items() if hasattr(module, "PAGE")}


def key(options: Options) -> str:
    """Return the name of a flight: its options."""
    return json.dumps(options, sort_keys=True)


def quantity_name(quantity: Quantity) -> str:
    """Return the name under which a number is kept."""
    return quantity if isinstance(quantity, str) else quantity.__name__


def fly(options: Options, quantities: Iterable[Quantity]) -> dict[str, float | None]:
    """Fly to the end and return the numbers that are kept, by `quantity_name`."""
    flown = Scenario(**options).fly()
    return {quantity_name(quantity): _value(flown, quantity) for quantity in quantities}


def settings(options: Options) -> str:
    """Return a digest of a flight's description, the numbers of its files included."""
    return flight_digest(Scenario(**options).check())


def torques(options: Options) -> list[float]:
    """Return the RMS of the torque on every axis in the first `BEGINNING_S`, N m."""
    flown = Scenario(**{**options, "duration": BEGINNING_S}).fly()
    rms: list[float] = np.sqrt(np.mean(flown.log.applied_torque**2, axis=0)).tolist()
    return rms


def is_same(kept: Mapping[str, Any], options: Options) -> bool:
    """Tell whether a flight is still set and flown as it was when it was kept."""
    if kept["settings"] != settings(options):
        return False
    before, now = np.array(kept["beginning"]), np.array(torques(options))
    return bool(before.shape == now.shape and np.all(abs(now - before) <= SAME * before.max()))


def _value(flown: FlownFlight, quantity: Quantity) -> float | None:
    if not isinstance(quantity, str):
        return quantity(flown)
    if (metric := flown.metrics.get(quantity)) is not None:
        return float(f"{metric:.6g}")
    value: Any = flown.report()
    *parts, last = quantity.split(".")
    for part in parts:
        value = (value or {}).get(part)
    value = None if value is None else value.get(last)  # no attitude of a base that is free
    return None if value is None else float(f"{value:.6g}")


def _exponent(found: re.Match[str]) -> str:
    return f"e{'-' if found[1] == '-' else ''}{found[2]}"
