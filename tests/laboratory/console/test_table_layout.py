"""Numbers and words of labels stay whole on terminals of 80 and 100 columns, and of any width."""

from __future__ import annotations

import io

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot.console.table_layout import LONGEST_WORD
from space_robot.console.tables import Column, JudgedCell, Table
from space_robot.console.terminal import terminal
from space_robot.console.terminal_tables import print_table
from space_robot_control.laws import laws

LAWS = sorted(laws())


def printed(table: Table, width: int) -> str:
    file = io.StringIO()
    print_table(table, terminal(file=file, width=width))
    return file.getvalue()


def by_law() -> Table:
    """As of `gains check`: a column a law."""
    columns = [Column("", is_label=True), *(Column(law, spec=".3g") for law in LAWS)]
    rows = [[f"joint{n}", *(1.2345e5 * (n + k) for k in range(len(LAWS)))] for n in range(1, 4)]
    return Table.of(
        "Torque that noise on the rate of an axis becomes, N m per rad/s", columns, rows
    )


def of_laws() -> Table:
    """As of a campaign: a row a law, columns with long headings, verdicts and a sentence."""
    columns = [
        Column("law", is_label=True),
        Column("met", spec=".1%"),
        Column("at least"),
        Column("requirement"),
        Column("attitude_drift_max", "rad", ".3e"),
        Column("why", is_label=True),
    ]
    verdict = JudgedCell("0.9786 < 1", "holds", "good")
    why = "the torque reported exceeds the one commanded in most of the flights"
    return Table.of("laws", columns, [[law, 0.997, "99.7 %", verdict, 1e-9, why] for law in LAWS])


@pytest.mark.parametrize("width", [70, 80, 100])
@pytest.mark.parametrize("table", [by_law(), of_laws()], ids=["by law", "of laws"])
def test_no_number_and_no_word_of_a_label_is_broken(table: Table, width: int) -> None:
    text = printed(table, width)
    words = text.split()
    for group in table.groups:
        for row in table.texts(group):
            for cell, column in zip(row, table.columns, strict=True):
                assert all(word in words for word in cell.split()), (cell, column)
    for column in table.columns:
        assert all(word in words for word in column.heading.split()), column
    assert all(len(line) <= width for line in text.splitlines())
    assert {"┡"} <= set(text)  # as tables, not as lines


def test_a_table_that_is_too_wide_is_printed_in_parts_with_their_labels() -> None:
    text = printed(by_law(), 80)
    parts = text.count("┏")
    assert parts == 2
    assert text.count("joint1") == parts
    assert all(text.count(f" {law} ") == 1 for law in LAWS)
    assert text.startswith("Torque that noise on the rate of an axis becomes, N m per rad/s\n")
    assert printed(by_law(), 200).count("┏") == 1


def test_a_cell_of_numbers_is_broken_only_if_the_table_is_too_wide() -> None:
    columns = [Column("law", is_label=True), *(Column(f"n{k}") for k in range(4))]
    table = Table.of("", columns, [["tde_stc", *(["0.97 < 1 holds"] * 4)]])
    assert printed(table, 80).count("0.97 < 1 holds") == 4
    assert printed(table, 70).count("0.97 < 1 holds") == 0
    assert printed(table, 70).split().count("holds") == 4


def test_a_unit_is_broken_from_its_name_only() -> None:
    columns = [Column("law", is_label=True), *(Column(f"torque_{k}", "N m") for k in range(6))]
    table = Table.of("", columns, [["tde_stc", *([0.5] * 6)]])
    assert printed(table, 80).count(" N m ") == printed(table, 200).count(" N m ") == 6
    assert printed(table, 200).count("torque_3, N m") == 1


def test_a_path_is_folded_and_all_of_it_is_shown() -> None:
    path = "/".join(["a_folder"] * 20)
    table = Table.of("", [Column("file", is_label=True), Column("n")], [[path, "1.5"]])
    text = printed(table, 40)
    assert "1.5" in text.split()
    assert "".join(c for c in text if c in path).count("a_folder") == 20


WORDS = st.text("abcdefgh_", min_size=1, max_size=LONGEST_WORD)


@given(
    st.lists(
        st.tuples(
            st.lists(WORDS, min_size=1, max_size=4).map(" ".join), st.floats(), st.floats(0, 1e9)
        ),
        min_size=1,
        max_size=4,
    ),
    st.integers(1, 120),
)
def test_every_word_and_number_is_whole_on_any_width(
    rows: list[tuple[str, float, float]], width: int
) -> None:
    columns = [Column("", is_label=True), Column("first", spec=".17g"), Column("second")]
    words = printed(Table.of("", columns, rows), width).split()
    for label, first, second in rows:
        assert f"{first:.17g}" in words
        assert f"{second}" in words
        assert all(word in words for word in label.split())
