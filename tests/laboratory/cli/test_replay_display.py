"""The lines of a replay's table: what is zero and rare stands nowhere, all else with its number."""

from __future__ import annotations

from typing import Any

import pytest

from space_robot.cli.replay_display import ALWAYS, COUNTS, counts


def report_of(**numbers: Any) -> dict[str, Any]:
    """What `counts` reads of a report, zero unless said otherwise."""
    report: dict[str, Any] = dict.fromkeys(COUNTS, 0)
    report |= {"unreadable": {"recorded": 0, "replayed": 0}, "ticks_per_s": None}
    return report | numbers


def test_of_an_empty_replay_only_the_usual_lines_stand() -> None:
    assert counts(report_of()) == [*((COUNTS[key], "0") for key in ALWAYS), ("ticks/s", "-")]


@pytest.mark.parametrize("key", COUNTS)
def test_each_number_stands_in_the_line_of_its_own(key: str) -> None:
    rows = dict(counts(report_of(**{key: 17})))
    assert rows.pop(COUNTS[key]) == "17"
    assert "17" not in rows.values()


@pytest.mark.parametrize(("key", "words"), [("recorded", "in the bag"), ("replayed", "now")])
def test_commands_that_cannot_be_read_are_counted_by_where_they_are(key: str, words: str) -> None:
    unreadable = {"recorded": 0, "replayed": 0} | {key: 3}
    rows = [row for row in counts(report_of(unreadable=unreadable)) if "cannot be read" in row[0]]
    assert rows == [(f"commands {words} that cannot be read", "3")]


def test_speed_is_a_whole_number() -> None:
    assert counts(report_of(ticks_per_s=1234.6))[-1] == ("ticks/s", "1235")
