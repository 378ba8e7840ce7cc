"""The benchmarks of the real graph: that they measure; no time is asserted."""

from __future__ import annotations

import json
from typing import Any

import pytest
from click.testing import CliRunner
from flights import ros_environment

from benchmarks.command import bench

pytestmark = pytest.mark.ros


@pytest.fixture(scope="module")
def sections() -> dict[str, list[dict[str, Any]]]:
    pytest.importorskip("rclpy")
    sections = ("graph", "composed", "clock", "recorder", "start-up")
    with pytest.MonkeyPatch.context() as patch:
        patch.delenv("ROS_DOMAIN_ID", raising=False)
        for name, value in ros_environment().items():
            patch.setenv(name, value)
        arguments = [*sections, "--short", "--repetitions", "1", "--json"]
        result = CliRunner().invoke(bench, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found: dict[str, list[dict[str, Any]]] = json.loads(result.stdout)["sections"]
    assert list(found) == list(sections)
    return found


def row(rows: list[dict[str, Any]], name: str) -> dict[str, Any]:
    return next(row for row in rows if row["name"] == name)


def test_the_graph_stands_beside_an_empty_and_a_naive_one(
    sections: dict[str, list[dict[str, Any]]],
) -> None:
    rows = [row for row in sections["graph"] if row["name"] == "lockstep graph"]
    assert [row["beside"] for row in rows] == [None, "empty graph", "two naive nodes"]
    assert all(row["median"] > 0.0 for row in rows)


def test_the_breakdown_of_a_tick_adds_up(sections: dict[str, list[dict[str, Any]]]) -> None:
    rows = sections["graph"]
    names = [row["name"] for row in rows]
    parts = names[names.index("a tick") + 1 :]
    assert {"plant: step plant", "controller: update controller"} <= set(parts)
    total = sum(row(rows, name)["median"] for name in parts)
    assert total == pytest.approx(row(rows, "a tick")["median"])


def test_the_composed_graph_stands_beside_four_processes(
    sections: dict[str, list[dict[str, Any]]],
) -> None:
    rows = sections["composed"]
    assert [row["beside"] for row in rows] == [None, "four processes", None, None]
    answered, punctual = (row["median"] for row in rows[2:])
    assert 0.0 < answered <= 100.0
    assert 0.0 <= punctual <= answered  # none is in time where other work runs beside it


def test_the_clock_section_counts_answers(sections: dict[str, list[dict[str, Any]]]) -> None:
    rows = sections["clock"]
    for scheduling in ("usual", "FIFO"):
        assert 0.0 <= row(rows, f"{scheduling}: ticks answered in time")["median"] <= 100.0
        for what in ("a tick comes late by", "answer after"):
            p50, p99, most = (
                row(rows, f"{scheduling}: {what}, {label}")["median"]
                for label in ("p50", "p99", "max")
            )
            assert 0.0 <= p50 <= p99 <= most


def test_the_recorder_loses_nothing_and_nodes_are_weighed(
    sections: dict[str, list[dict[str, Any]]],
) -> None:
    rows = sections["recorder"]
    assert row(rows, "messages lost")["median"] == 0.0
    for node in ("plant", "controller", "mission", "recorder"):
        assert row(rows, f"{node}, memory")["median"] > 10.0


def test_start_up_is_measured(sections: dict[str, list[dict[str, Any]]]) -> None:
    assert all(row["median"] > 0.0 for row in sections["start-up"])
