"""How the nodes of launched flights end, and what a launch makes of it; without launch."""

from __future__ import annotations

import asyncio
import json
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest

from space_robot.flight.graph.launched import LaunchedGraph, launched_parameters, report_failure
from space_robot.flight.graph.node_names import NODE_NAMES
from space_robot.flight.plan import Flight, FlightPlan, resolve

RECORDER, MISSION, CONTROLLER, PLANT = NODE_NAMES
STOPPED = "stopped before the flight's end"


@pytest.mark.parametrize(
    ("ends", "failures"),
    [
        ([(PLANT, 0), (MISSION, 0), (CONTROLLER, 0), (RECORDER, 0)], []),
        ([(PLANT, 0), (RECORDER, 1)], ["recorder_node ended with exit code 1"]),
        ([(MISSION, -9), (PLANT, 0), (RECORDER, 1)], ["mission_node ended with exit code -9"]),
        ([(CONTROLLER, 0), (PLANT, 0)], ["controller_node ended before the flight did"]),
        ([(PLANT, 2)], ["plant_node ended with exit code 2"]),
    ],
)
def test_a_flight_is_complete_when_the_plant_ends_first_and_all_end_well(
    ends: list[tuple[str, int]], failures: list[str]
) -> None:
    graph = LaunchedGraph()
    reasons = [graph.note_end(name, code, is_stopped=False) for name, code in ends]
    assert [reason for reason in reasons if reason] == failures
    assert graph.has_ended == (len(ends) == len(NODE_NAMES))


def test_a_flight_that_is_stopped_by_ctrl_c_is_not_complete() -> None:
    """And one that was complete before is."""
    stopped, complete = LaunchedGraph(), LaunchedGraph()
    assert complete.note_end(PLANT, 0, is_stopped=False) == ""
    assert [complete.note_end(n, 0, is_stopped=True) for n in NODE_NAMES[:3]] == [""] * 3
    assert stopped.note_end(PLANT, 0, is_stopped=True) == STOPPED
    assert [stopped.note_end(n, 0, is_stopped=True) for n in NODE_NAMES[:3]] == [""] * 3
    assert stopped.has_ended
    assert complete.has_ended


def test_a_failure_is_an_error_of_the_loop_and_ends_nothing() -> None:
    """launch returns exit code 1 after an error in its event loop."""
    errors: list[dict[str, Any]] = []

    async def run() -> str:
        loop = asyncio.get_running_loop()
        loop.set_exception_handler(lambda _, context: errors.append(context))
        report_failure(SimpleNamespace(asyncio_loop=loop), "flights/mine: no view")
        await asyncio.sleep(0.0)
        return "goes on"

    assert asyncio.run(run()) == "goes on"
    assert errors == [{"message": "error: flights/mine: no view"}]


def test_the_file_has_autostart_and_what_every_ros_node_has(tmp_path: Path) -> None:
    flight = Flight(resolve(FlightPlan(duration=0.1)))
    of_ros = {"mission": {"use_sim_time": True}}
    file = launched_parameters(flight, tmp_path / "bag", False, tmp_path, of_ros)
    nodes = json.loads(file.read_text("utf-8"))
    parameters = {
        node: nodes[f"/**/{node}_node"]["ros__parameters"] for node in ("plant", "mission")
    }
    assert [values["autostart"] for values in parameters.values()] == [False, False]
    assert parameters["mission"]["use_sim_time"] is True
    assert "use_sim_time" not in parameters["plant"]
