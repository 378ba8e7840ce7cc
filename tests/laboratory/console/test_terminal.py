"""Words and tables on terminals of any width, with any letters in them."""

from __future__ import annotations

import io
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st
from rich.table import Table

from space_robot.analysis import analyze
from space_robot.analysis.report_tables import metrics_table, rms_table
from space_robot.cli.report_display import print_comparison
from space_robot.console.terminal import say, show, terminal
from space_robot.console.terminal_tables import print_table
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate

WIDTHS = (1, 10, 20, 33, 40, 60, 80, 100, 200)


@pytest.fixture(scope="module")
def report() -> dict[str, Any]:
    return analyze(simulate(Flight(resolve(FlightPlan(duration=0.05, case="2")))))


def shown(width: int, *prints: Any) -> str:
    file = io.StringIO()
    for print_ in prints:
        print_(terminal(file=file, width=width))
    return file.getvalue()


@pytest.mark.parametrize("width", WIDTHS)
def test_every_number_is_shown_whole_on_any_width(report: dict[str, Any], width: int) -> None:
    text = shown(width, lambda console: print_table(rms_table(report), console))
    words = text.split()
    shown_values = report["rms"]["mean_axis"] | {
        "attitude": report["attitude_error_deg"]["mean_axis"]
    }
    for key, value in shown_values.items():
        assert f"{value:{'.4f' if 'torque' in key else '.3e'}}" in words
        assert key in words
    text = shown(
        width,
        lambda console: print_table(metrics_table(report), console),
        lambda console: print_comparison({"one": report, "two": report}, console),
    )
    maxima = report["maxima"] | {"attitude": report["attitude_error_deg"]["max"]}
    for value in maxima.values():
        assert text.split().count(f"{value:.4g}") >= 3


def test_a_narrow_table_becomes_lines_that_name_each_number() -> None:
    table = Table(title="torques")
    table.add_column("")
    table.add_column("")
    table.add_column("one", justify="right")
    table.add_row("maximum", "base_torque (N m)", "0.123456789")
    table.add_row("", "torque_1_3 (N m)", "0.2")
    lines = shown(20, lambda console: show(table, console)).splitlines()
    assert lines == [
        "torques",
        "maximum base_torque (N m)",
        "  one: 0.123456789",
        "maximum torque_1_3 (N m)",
        "  one: 0.2",
    ]


@given(st.text())
def test_any_text_is_shown_as_it_is_and_never_as_control_letters(text: str) -> None:
    def table(console: Any) -> None:
        shows = Table(title=text)
        shows.add_column(text)
        shows.add_column("n", justify="right")
        shows.add_row(text, "1.5")
        show(shows, console)

    out = shown(400, lambda console: say(console, f"<{text}>"), table)
    assert "1.5" in out
    assert all(line.isprintable() for line in out.split("\n"))
    if text.isprintable():
        assert f"<{text}>" in out


@pytest.mark.parametrize("text", ["[/red]", "[bold]x", ":smile:", "\\[x]", "$x$", "[link=a]b"])
def test_markup_is_text(text: str) -> None:
    assert shown(80, lambda console: say(console, text)) == text + "\n"


def test_a_bag_that_does_not_say_what_flew_has_a_title_without_none(report: dict[str, Any]) -> None:
    unknown = dict.fromkeys(("controller", "case", "gains", "robot"))
    foreign = {**report, **unknown, "laws": []}
    text = shown(100, lambda console: print_table(rms_table(foreign), console))
    assert text.startswith("unknown law: 100 ticks, 0.05 s")
    assert "None" not in text


def test_the_lines_of_a_title_and_words_in_two_lines_stay_what_they_are() -> None:
    """Of a table that becomes lines, as one of a diverged flight in a narrow terminal."""
    table = Table(title="tde_stc\nsensors ideal")
    table.add_column("naviga-\ntion RMS", justify="right")
    table.add_row(f"{1e90:.4f}")
    lines = shown(60, lambda console: show(table, console)).splitlines()
    assert lines == ["tde_stc", "sensors ideal", f"  navigation RMS: {1e90:.4f}"]
