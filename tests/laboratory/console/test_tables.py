"""One model of a table: what it is as Markdown, CSV, JSON, in a page and on a terminal."""

from __future__ import annotations

import csv
import io
import re

import pytest

from space_robot.analysis.template import template
from space_robot.console.tables import (
    Column,
    Group,
    JudgedCell,
    Table,
    as_csv,
    as_markdown,
    as_records,
)
from space_robot.console.terminal import terminal
from space_robot.console.terminal_tables import print_table

COLUMNS = Column("law", is_label=True), Column("error", "rad", ".2e"), Column("verdict")
ROWS = [
    ["tde_stc", 0.000123456, JudgedCell("1 < 2", "holds", "good")],
    ["<ctc>", None, JudgedCell("", "fails", "bad")],
]


@pytest.fixture
def table() -> Table:
    return Table("flights", COLUMNS, [Group(ROWS, "case 1", "light"), Group(ROWS[:1], "case 2")])


def printed(table: Table, width: int) -> str:
    file = io.StringIO()
    print_table(table, terminal(file=file, width=width))
    return file.getvalue()


def test_markdown_has_formatted_numbers_and_a_dash_where_there_is_none(table: Table) -> None:
    lines = as_markdown("all", [table]).splitlines()
    assert lines[:4] == ["# all", "", "## flights", ""]
    assert lines[4] == "| law | error, rad | verdict |"
    assert lines[6:8] == ["| tde_stc | 1.23e-04 | 1 < 2 holds |", "| <ctc> | - | fails |"]


def test_csv_and_json_have_full_precision_and_every_row(table: Table) -> None:
    rows = list(csv.DictReader(io.StringIO(as_csv(table))))
    assert [row["error"] for row in rows] == ["0.000123456", "", "0.000123456"]
    records = as_records(table)
    assert [record["error"] for record in records] == [0.000123456, None, 0.000123456]
    assert [record["law"] for record in records] == [row["law"] for row in rows]


@pytest.mark.parametrize("width", [10, 40, 100])
def test_a_terminal_of_any_width_shows_every_number(table: Table, width: int) -> None:
    words = printed(table, width).split()
    for word in ("1.23e-04", "holds", "fails"):
        assert word in words


def test_a_group_is_named_once_and_notes_stand_below(table: Table) -> None:
    text = printed(Table(table.title, table.columns, table.groups, ["as flown"]), 100)
    assert text.count("case 1") == text.count("case 2") == 1
    assert text.rstrip().endswith("as flown")
    assert "case" not in printed(Table.of("flights", COLUMNS, ROWS), 100)


def test_a_page_escapes_and_tells_good_from_bad(table: Table) -> None:
    module = template("space_robot.analysis", "table.html.j2").module
    html = str(module.draw(table))  # type: ignore[attr-defined]
    assert "&lt;ctc&gt;" in html
    assert "<ctc>" not in html
    assert re.findall(r'class="(good|bad)">([^<]*)<', html) == [
        ("good", "1 &lt; 2 holds"),
        ("bad", "fails"),
        ("good", "1 &lt; 2 holds"),
    ]
    assert html.count('class="group"') == 2


@pytest.mark.parametrize("width", [50, 56, 62, 80])
def test_names_of_groups_are_wrapped_not_cut(width: int) -> None:
    columns = Column(is_label=True), Column("flights/one"), Column("flights/two")
    cells = [["base_torque (N m/s)", "12.2 / 4.321e-05", "4.321e-05"]] * 2
    text = printed(Table("", columns, [Group(cells, "navigation error > 100 Hz")]), width)
    assert {"navigation", "error", "100", "Hz"} <= set(text.split())
