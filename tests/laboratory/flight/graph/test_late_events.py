"""Events that are heard of when the nodes end are in the report, too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import pytest
from flights import space_robot_here

from space_robot.flight.graph.monitor import Event, Monitor
from space_robot.flight.graph.processes import Graph

pytest.importorskip("rclpy")


def test_events_heard_of_at_the_end_are_reported(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Nodes report once a second and when they end: all that is new is held back till then."""
    poll, stop = Monitor.poll, Graph.stop
    held: list[Event] = []
    stopped: list[Graph] = []

    def late_poll(self: Monitor) -> list[Event]:
        held.extend(poll(self))
        return held if stopped else []

    def noted_stop(self: Graph, *args: Any) -> None:
        stop(self, *args)
        stopped.append(self)

    monkeypatch.setattr(Monitor, "poll", late_poll)
    monkeypatch.setattr(Graph, "stop", noted_stop)
    ended = space_robot_here(
        *("fly", "--composed", "--duration", "0.6", "--fault", "drop_command@0.1-0.4", "--json"),
        *("--set", "plant.hold_ticks=100", "--set", "controller.hold_ticks=100"),
        *("--bag", str(tmp_path / "bag")),
    )
    assert ended.returncode == 0, ended.stderr
    told = [(event["node"], event["what"]) for event in json.loads(ended.stdout)["graph"]["events"]]
    assert ("plant_node", "safe: no good command, the torque is zero") in told
