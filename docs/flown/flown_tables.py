"""Tables and numbers of pages that are flown, and the files that keep what was flown.

A page has its definition here in `docs/flown`: `NAME.py` with a `PAGE`. Its tables stand in the
page between the marks of `put`; a `Sentence` stands anywhere in its text. What the flights gave is
kept in `NAME.json`, so a page can be compared with it without flying.

A kept flight is stale if its settings (all parameters, gains and files behind its options) are not
those of today, or if a number of it, or of its beginning, is another when it is flown again. The
tests fly again what `is_drawn`, and of long flights the beginning; ``python docs/flown --all``,
which is part of a release, flies everything to its end.
"""

from __future__ import annotations

import json
import math
import re
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from functools import cache
from importlib import import_module
from pathlib import Path
from typing import Any, NamedTuple

from marks import markdown, put

from space_robot import Scenario
from space_robot.analysis import measure
from space_robot.api.flown_flight import FlownFlight
from space_robot.campaign.flown.manifest import ROOT, digest, flight_digest, source_digest
from space_robot.flight.batch import batches, fly_group
from space_robot.flight.plan import Flight

DOCS = Path(__file__).parents[1]
BEGINNING_TICKS = 60_000
"""Of a longer flight the tests fly no more."""
SHARE = 3
"""The tests fly one of so many flights."""
SAME, ROUNDING = 1e-5, 1e-14
"""Relative: less than a page shows; and absolute."""
NUMBER = r"(-?\d+(?:\.\d+)?(?:e-?\d+)?|-)"
Quantity = str | Callable[[FlownFlight], float | None]
"""Name of a metric, or what computes another number; None: the flight has no such number."""
Options = Mapping[str, Any]
"""Of a `Scenario`."""
Kept = dict[str, dict[str, Any]]
"""What was flown: settings, numbers and those of the beginning by the `key` of the options."""


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
        text = re.sub(r"e([+-])0*(\d)", _exponent, format(self.scale * value, self.form))
        return text.rstrip(".")


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
            ValueError: see `put`.
        """
        rows = [[c if isinstance(c, str) else c.text(kept) for c in row] for row in self.rows]
        return put(page, self.name, markdown(self.head, rows))


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
            ValueError: see `places`.
        """
        for number, place in reversed([*zip(self.numbers_, self.places(page), strict=True)]):
            page = f"{page[: place.start]}{number.text(kept)}{page[place.stop :]}"
        return page

    def places(self, page: str) -> list[slice]:
        """Return where in the page its numbers stand.

        Raises:
            ValueError: the words are not in the page, or more than once.
        """
        words = (re.escape(part).replace(r"\ ", r"\s+") for part in self.template.split("{}"))
        matches = list(re.finditer(NUMBER.join(words), page))
        if len(matches) != 1:
            raise ValueError(f"{len(matches)} times in the page: {self.template!r}")
        return [slice(*matches[0].span(group + 1)) for group in range(len(self.numbers_))]


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

    def stale(self, is_flown: Callable[[str], bool]) -> list[str]:
        """Return the keys of flights that are not kept, or would not be flown so today.

        Args:
            is_flown: of a key: whether its numbers are compared, not only its settings.
        """
        flights, kept = self.flights(), self.kept()
        stale, flown = set(), {}
        for name, (options, quantities) in flights.items():
            flight = Scenario(**options).check()
            entry = kept.get(name, {"settings": "", "numbers": {}})
            wanted = {quantity_name(quantity) for quantity in quantities}
            if entry["settings"] != flight_digest(flight) or entry["numbers"].keys() != wanted:
                stale.add(name)
            elif is_flown(name):
                flown[name] = beginning(options, flight)
        for name, flight in fly(flown):
            of_tests = kept[name].get("beginning", kept[name]["numbers"])
            if not is_same(of_tests, numbers_of(flight, flights[name][1])):
                stale.add(name)
        return sorted(stale)

    def fly(self, names: Iterable[str]) -> None:
        """Fly some flights again, and keep what they give; forget those that the page has not."""
        flights, kept = self.flights(), self.kept()
        kept = {name: kept[name] for name in flights if name in kept}
        checked = {name: Scenario(**flights[name][0]).check() for name in names}
        for name, flight in checked.items():
            kept[name] = {"settings": flight_digest(flight)}
        long = {name: flight for name, flight in checked.items() if flight.ticks > BEGINNING_TICKS}
        begun = {name: beginning(flights[name][0], flight) for name, flight in long.items()}
        for part, flown in (("numbers", checked), ("beginning", begun)):
            for name, flight in fly(flown):
                kept[name][part] = numbers_of(flight, flights[name][1])
        self.file.write_text(json.dumps(kept, indent=1, sort_keys=True) + "\n", "utf-8")

    def text(self) -> str:
        """Read the page."""
        return (DOCS / self.path).read_text("utf-8")

    def written(self, text: str) -> str:
        """Return the page's text with what was flown.

        Raises:
            ValueError: a table or sentence has no place in it.
        """
        kept = self.kept()
        for part in self.parts:
            text = part.put_into(text, kept)
        return text


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


def is_drawn(name: str) -> bool:
    """Tell whether the tests fly a flight again: others for each state of the packages' code."""
    return int(digest(f"{_sources()}{name}".encode()), 16) % SHARE == 0


def beginning(options: Options, flight: Flight) -> Flight:
    """Return what of a flight the tests fly: all of it, or its first `BEGINNING_TICKS`."""
    if flight.ticks <= BEGINNING_TICKS:
        return flight
    return Scenario(**{**options, "duration": BEGINNING_TICKS * flight.period}).check()


def fly(flights: Mapping[str, Flight]) -> Iterator[tuple[str, FlownFlight]]:
    """Fly checked flights, short ones in lanes; yield each with its name."""
    names = list(flights)
    short = ((n, own) for n, own in enumerate(flights.values()) if own.ticks <= BEGINNING_TICKS)
    long = ([(n, own)] for n, own in enumerate(flights.values()) if own.ticks > BEGINNING_TICKS)
    for group in (*batches(short), *long):  # a long flight alone has its log in a file
        together = [flight for _, flight in group]
        for (number, flight), one in zip(group, fly_group(together), strict=True):
            yield names[number], FlownFlight(flight, one.ending, None, one.log)


def numbers_of(flown: FlownFlight, quantities: Iterable[Quantity]) -> dict[str, float | None]:
    """Return the numbers of a flight that are kept, by `quantity_name`."""
    names = [quantity for quantity in quantities if isinstance(quantity, str)]
    numbers: dict[str, float | None] = {**measure(flown.log.longest_stretch(), names)}
    for quantity in quantities:
        name = quantity_name(quantity)
        value = numbers.get(name) if isinstance(quantity, str) else quantity(flown)
        numbers[name] = None if value is None else float(f"{value:.6g}")
    return numbers


def is_same(kept: Mapping[str, float | None], now: Mapping[str, float | None]) -> bool:
    """Tell whether a flight gave the same numbers."""
    return kept.keys() == now.keys() and all(map(_is_close, kept.values(), map(now.get, kept)))


def _is_close(first: float | None, second: float | None) -> bool:
    if first is None or second is None:
        return first is second
    return math.isclose(first, second, rel_tol=SAME, abs_tol=ROUNDING)


@cache
def _sources() -> str:
    return source_digest(ROOT)


def _exponent(found: re.Match[str]) -> str:
    return f"e{'-' if found[1] == '-' else ''}{found[2]}"
