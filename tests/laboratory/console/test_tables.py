"""Tables and words: as Markdown, CSV, JSON, in a page, on terminals of any width."""

from __future__ import annotations

import io
import math
import re
import threading

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.analysis.report import template
from space_robot.console import progress
from space_robot.console.tables import Column, Group, JudgedCell, Table, as_latex, as_markdown
from space_robot.console.terminal import LONGEST_WORD, print_table, say, terminal
from space_robot_control.laws import laws

COLUMNS = Column("law", is_label=True), Column("error", "rad", ".2e"), Column("verdict")


ROWS = [
    ["tde_stc", 0.000123456, JudgedCell("1 < 2", "holds", "good")],
    ["<ctc>", None, JudgedCell("", "fails", "bad")],
]


@pytest.fixture
def table() -> Table:
    return Table("flights", COLUMNS, [Group(ROWS, "case 1", "light"), Group(ROWS[:1], "case 2")])


def test_markdown_has_formatted_numbers(table: Table) -> None:
    """With a dash where there is none."""
    lines = as_markdown("all", [table]).splitlines()
    assert lines[:4] == ["# all", "", "## flights", ""]
    assert lines[4] == "| law | error, rad | verdict |"
    assert lines[6:8] == ["| tde_stc | 1.23e-04 | 1 < 2 holds |", "| <ctc> | - | fails |"]


def test_latex_escapes_texts_and_has_powers_of_ten() -> None:
    columns = Column("a_b", is_label=True), Column("50 %", spec="#.3g")
    rows = [["x^2 & {y} #1 $ ~ \\ N\u00a0m", value] for value in (5.09e-7, -12.0, 123.0, math.inf)]
    lines = as_latex(
        Table("case_1, 5 %", columns, [Group([*rows, ["<", None]], "r_1")])
    ).splitlines()
    assert r"\caption{case\_1, 5 \%}" in lines
    assert lines[3:6] == [r"\begin{tabular}{lr}", r"\toprule", r"a\_b & 50 \% \\"]
    assert lines[7] == r"\multicolumn{2}{l}{\textit{r\_1}} \\"
    text = r"x\textasciicircum{}2 \& \{y\} \#1 \$ \textasciitilde{} \textbackslash{} N\,m"
    numbers = [r"$5.09\times10^{-7}$", "$-12.0$", "$123$", r"$\infty$"]
    assert lines[8:12] == [rf"{text} & {number} \\" for number in numbers]
    assert lines[12:14] == [r"$<$ & - \\", r"\bottomrule"]


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


def printed(table: Table, width: int) -> str:
    file = io.StringIO()
    print_table(table, terminal(file=file, width=width))
    return file.getvalue()


def test_a_table_that_is_too_wide_is_printed_in_parts_with_their_labels() -> None:
    names = sorted(laws())
    columns = [Column("", is_label=True), *(Column(law, spec=".3g") for law in names)]
    rows = [[f"joint{n}", *(1.2345e5 * (n + k) for k in range(len(names)))] for n in range(1, 4)]
    table = Table.of(f"Torque of {'noise ' * 8}, N m per rad/s", columns, rows)
    text = printed(table, 80)
    assert all(len(line) <= 80 for line in text.splitlines())
    parts = text.count("┏")
    assert parts == 2
    assert text.count("joint1") == parts
    assert all(text.count(f" {law} ") == 1 for law in names)
    assert text.startswith(f"{table.title}\n")
    assert printed(table, 200).count("┏") == 1


WORDS = st.text("abcdefgh_", min_size=1, max_size=LONGEST_WORD)


@settings(max_examples=50)
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


@settings(max_examples=30)
@given(st.text())
def test_any_text_is_shown_as_it_is_and_never_as_control_letters(text: str) -> None:
    file = io.StringIO()
    console = terminal(file=file, width=400)
    say(console, f"<{text}>")
    columns = [Column(text, is_label=True), Column("n")]
    print_table(Table.of(text, columns, [[text, "1.5"]]), console)
    out = file.getvalue()
    assert "1.5" in out
    assert all(line.isprintable() for line in out.split("\n"))
    if text.isprintable():
        assert f"<{text}>" in out


def test_what_is_watched_is_a_line_now_and_then_and_complete_at_the_end(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.setattr(progress, "WATCH_S", 0.001)
    monkeypatch.setattr(progress, "WATCHED_LINE_S", 0.0)
    counts = iter(range(4))
    seen = threading.Event()

    def count() -> int:
        done = next(counts, 4)
        if done == 4:
            seen.set()
        return done

    with progress.watching_progress("kernels", 4, count):
        assert seen.wait(10.0)
    said = capsys.readouterr().err.splitlines()
    assert [f"kernels {k}/4" for k in range(1, 5)] == list(dict.fromkeys(said[1:-1]))[-4:]
    assert "4/4" in said[-1]
    assert not [thread for thread in threading.enumerate() if "watch" in thread.name]
