"""Tables and numbers of the pages that `python docs/flown` makes are those of today's flights.

Nothing is flown to its end: what was flown is kept in docs/flown, with digests of its settings and
the torques of its beginning.
"""

from __future__ import annotations

import sys

import pytest
from paths import DOCS

sys.path.append(str(DOCS / "flown"))

from flown_tables import Page, Table, fly, is_same, pages

from space_robot import Scenario

PAGES: dict[str, Page] = pages()


@pytest.mark.parametrize("name", PAGES)
def test_a_page_shows_what_was_flown(name: str) -> None:
    """And every table of flights in it is one that the command makes."""
    page = PAGES[name]
    text = (DOCS / page.path).read_text("utf-8")
    assert page.written() == text, f"run `python docs/flown {name}`"
    tables = [part for part in page.parts if isinstance(part, Table)]
    assert text.count("<!-- table ") == len(tables)


@pytest.mark.parametrize("name", PAGES)
def test_what_was_flown_is_what_would_be_flown_today(name: str) -> None:
    assert PAGES[name].stale() == [], f"run `python docs/flown {name}`"
    assert PAGES[name].kept().keys() == PAGES[name].flights().keys()


WHOLE_S = 60.0
"""Longer flights are flown to their end by the command only."""


@pytest.mark.parametrize("name", PAGES)
def test_a_whole_flight_of_a_page_gives_the_numbers_that_are_kept(name: str) -> None:
    """One for each page; so a change that does not show at the beginning of a flight is seen."""
    for key, (options, quantities) in PAGES[name].flights().items():
        flight = Scenario(**options).check()
        if flight.ticks * flight.period <= WHOLE_S:
            kept, flown = PAGES[name].kept()[key]["numbers"], fly(options, quantities)
            missing = [quantity for quantity, number in kept.items() if number is None]
            assert [flown.pop(quantity) for quantity in missing] == [None] * len(missing)
            assert flown == pytest.approx({q: kept[q] for q in kept if q not in missing}, rel=1e-3)
            return
    pytest.skip(f"all are longer than {WHOLE_S:g} s")


def test_a_flight_with_other_gains_noise_or_hardware_is_stale() -> None:
    (kept, options) = next(
        (PAGES["actuators"].kept()[key], options)
        for key, (options, _) in PAGES["actuators"].flights().items()
        if options.get("sensors") == "fine"
    )
    assert is_same(kept, options)
    assert not is_same(kept, {**options, "gains": "tuned"})
    assert not is_same(kept, {**options, "actuators": "wheels"})
    louder = {name: value * 1.01 for name, value in enumerate(kept["beginning"])}
    assert not is_same({**kept, "beginning": list(louder.values())}, options)
