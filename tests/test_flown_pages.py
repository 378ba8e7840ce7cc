"""Numbers of pages are those of programs: `python docs/flown` flies and writes most of them."""

from __future__ import annotations

import re
import sys

import pytest
from paths import DOCS, ROOT
from shown import NUMBER, step

sys.path.append(str(DOCS / "flown"))

from flown_tables import Page, Sentence, Table, is_drawn, is_same, key, pages, quantity_name

PAGES: dict[str, Page] = pages()
TABLE = re.compile(r"^\|.*\|\n\|[-:|]+\|\n((?:\|.*\|\n)+)", re.M)
MADE = re.compile(r"<!-- table (\S+) -->\n\n(.*?)\n<!-- end -->", re.S)


@pytest.mark.parametrize("name", PAGES)
def test_a_page_shows_what_was_flown(name: str) -> None:
    text = PAGES[name].text()
    assert PAGES[name].written(text) == text, f"run `python docs/flown {name}`"


@pytest.mark.parametrize("name", PAGES)
def test_what_was_flown_is_what_would_be_flown_today(name: str) -> None:
    """All settings, and the numbers of a third of the flights."""
    page = PAGES[name]
    assert page.kept().keys() == page.flights().keys()
    assert page.stale(is_drawn) == [], f"run `python docs/flown {name}`"


def places(part: Table | Sentence, text: str) -> list[slice]:
    """Where the numbers of a table or sentence stand in a page."""
    if isinstance(part, Sentence):
        return part.places(text)
    (made,) = (match for match in MADE.finditer(text) if match[1] == part.name)
    return [slice(*number.span()) for number in NUMBER.finditer(text, *made.span(2))]


@pytest.mark.parametrize("name", PAGES)
def test_a_last_digit_that_is_changed_is_noticed(name: str) -> None:
    """In the page, and in what is kept: flights are compared more closely than they are shown."""
    page = PAGES[name]
    text, kept = page.text(), page.kept()
    spots = [(part, place) for part in page.parts for place in places(part, text)]
    for part, place in spots:
        digits, e, exponent = text[place].partition("e")
        other = f"{digits[:-1]}{(int(digits[-1]) + 1) % 10}{e}{exponent}"
        changed = f"{text[: place.start]}{other}{text[place.stop :]}"
        assert part.put_into(changed, kept) == text
    shown = [number for part in page.parts for number in part.numbers()]
    assert len(spots) >= sum(number.text(kept) != "-" for number in shown) > 0
    for number in shown:
        flown, quantity = kept[key(number.options)]["numbers"], quantity_name(number.quantity)
        if flown[quantity] is not None:
            changed_by = step(number.text(kept)) / number.scale
            assert is_same(flown, flown)
            assert not is_same(flown, {**flown, quantity: flown[quantity] + changed_by})
            assert not is_same(flown, {**flown, quantity: None})


OTHERS = {
    "docs/compare.md": "tests/test_docs.py",
    "docs/explanation/campaign_statistics.md": "tests/laboratory/campaign/test_verdicts.py",
    "docs/explanation/errata.md": "tests/test_docs.py",
    "docs/explanation/ets_vii.md": "tests/test_ets_vii.py",
    "docs/explanation/fault_handling.md": "settings",
    "docs/explanation/kernels.md": "words of code",
    "docs/explanation/lanes.md": "times of a machine",
    "docs/explanation/model_predictive_control.md": "times of a machine, and flights as slow",
    "docs/explanation/nominal_inertia.md": "robots that are not shipped",
    "docs/explanation/real_spacecraft.md": "campaigns of many flights",
    "docs/explanation/same_bits.md": "tests/model/elementary/test_functions.py",
    "docs/explanation/stability.md": "tests/test_shown_outputs.py",
    "docs/manual/actuators.md": "settings",
    "docs/manual/bags.md": "tests/test_shown_outputs.py, but for times of a machine",
    "docs/manual/campaign_variables.md": "settings",
    "docs/manual/capture.md": "not yet",
    "docs/manual/frameworks.md": "versions",
    "docs/manual/missions.md": "tests/test_shown_outputs.py",
    "docs/manual/python.md": "settings",
    "docs/manual/sensors.md": "settings",
    "docs/measurements/performance.md": "times of a machine",
    "docs/measurements/reality.md": "not yet",
    "docs/your_robot.md": "not yet",
    "ets_vii": "tests/test_ets_vii.py",
    "ets_vii_wheels": "tests/test_ets_vii.py",
    "fronts": "tests/test_docs.py",
    "random_arms": "300 flights and 200 gain sets",
    "robots": "tests/test_docs.py",
    "rules": "tests/laboratory/campaign/test_verdicts.py",
}
"""What compares the tables of numbers that are not flown here, by page or between marks by name,
or why nothing does; references are generated."""


def test_each_other_table_of_numbers_is_compared_elsewhere_or_exempt() -> None:
    texts = {page: page.read_text("utf-8") for page in (ROOT / "README.md", *DOCS.rglob("*.md"))}
    flown = {
        (DOCS / page.path, part.name)
        for page in PAGES.values()
        for part in page.parts
        if isinstance(part, Table)
    }
    marked = {(page, name) for page, text in texts.items() for name, _ in MADE.findall(text)}
    others = {name for _, name in marked - flown}
    others |= {
        page.relative_to(ROOT).as_posix()
        for page, text in texts.items()
        for rows in TABLE.findall(MADE.sub("", text))
        if page.parent != DOCS / "reference"
        and sum(bool(re.search(r"\d\.\d|\de-?\d", cell)) for cell in rows.split("|")) > 1
    }
    assert others == OTHERS.keys()
    for reason in OTHERS.values():
        assert not reason.startswith("tests/") or (ROOT / reason.split(",")[0]).exists()
