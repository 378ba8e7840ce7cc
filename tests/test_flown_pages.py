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
    "tests/test_docs.py": "compare drifts explanation/errata fronts made robots rows",
    "tests/laboratory/campaign/test_verdicts.py": "explanation/campaign_statistics rules",
    "tests/test_ets_vii.py": "explanation/ets_vii ets_vii ets_vii_wheels",
    "settings": (
        "explanation/fault_handling manual/actuators manual/campaign_variables "
        "manual/python manual/sensors"
    ),
    "words of code": "explanation/kernels",
    "times of a machine": "explanation/lanes measurements/performance",
    "campaigns of many flights": "explanation/real_spacecraft",
    "tests/model/elementary/test_functions.py": "explanation/same_bits",
    "tests/test_shown_outputs.py": "explanation/stability manual/missions",
    "tests/test_shown_outputs.py, but for times of a machine": "manual/bags",
    "not yet": "manual/capture measurements/reality your_robot",
    "versions": "manual/frameworks",
    "300 flights and 200 gain sets": "random_arms",
}
"""Pages in docs/, or names of tables between marks, by what compares the numbers that are not flown
here, or why nothing does; references are generated."""


def test_each_other_table_of_numbers_is_compared_elsewhere_or_exempt() -> None:
    texts = {page: page.read_text("utf-8") for page in DOCS.rglob("*.md")}
    flown = {
        (DOCS / page.path, part.name)
        for page in PAGES.values()
        for part in page.parts
        if isinstance(part, Table)
    }
    marked = {(page, name) for page, text in texts.items() for name, _ in MADE.findall(text)}
    others = {name for _, name in marked - flown}
    others |= {
        page.relative_to(DOCS).with_suffix("").as_posix()
        for page, text in texts.items()
        for rows in TABLE.findall(MADE.sub("", text))
        if page.parent != DOCS / "reference"
        and sum(bool(re.search(r"\d\.\d|\de-?\d", cell)) for cell in rows.split("|")) > 1
    }
    assert sorted(others) == sorted(" ".join(OTHERS.values()).split())
    for reason in OTHERS:
        assert not reason.startswith("tests/") or (ROOT / reason.split(",")[0]).exists()
