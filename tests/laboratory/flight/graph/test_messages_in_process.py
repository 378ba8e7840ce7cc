"""Flights with faults of every kind: a graph of nodes and `simulate`, message by message.

One graph has its four processes, the others are composed.
"""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Callable
from pathlib import Path

import pytest
from bags import messages_of
from flights import Flown

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_sim.plant.faults import MESSAGE_KINDS

pytest.importorskip("rclpy")

SEED = 5
SWAP = "0.31:tde_smc"
FLIGHTS: dict[str, tuple[str, ...]] = {
    "spoilt": (
        "nan_state@0.05-0.2:0.05",
        "inf_state@0.1-0.2:0.05",
        "scaled_quaternion@0.1-0.3:0.05",
        "stamp_back@0.2-0.45:0.1",
        "stamp_jump@0.3-0.45:0.1",
        "nan_command@0.1-0.4:0.05",
        "inf_command@0.1-0.45:0.05",
    ),
    "late and lost": (
        "drop_state@0.05-0.45:0.1",
        "repeat_state@0.1-0.45:0.2",
        "delay_state@0.2-0.25:2",
        "jitter_state@0.22-0.4:3",
        "drop_command@0.05-0.3:0.1",
        "repeat_command@0.1-0.4:0.3",
        "delay_command@0.15-0.2:2",
        "jitter_command@0.3-0.45:3",
    ),
    "long silences, and parts": (
        "scaled_quaternion@0.05-0.12",
        "drop_command@0.2-0.27",
        "drop_state@0.3-0.37",
        "noise_gyro@0:1e-6",
        "saturate_joints@0.1-0.2:0.5",
        "torque_scale@0.1:joints=0.999",
        "drive_bias@0.2:base_y=0.001",
    ),
    "all that is new": (
        "drop_state@0.1-0.3:0.1",
        "jitter_command@0.2-0.4:2",
        "stamp_back@0.1-0.4:0.05",
        "tracker_blind@0.2-0.3",
        "gyro_bias@0.1:base_z=1e-6",
        "torque_bias@0.3:joint2=0.01",
    ),
}
"""Flights of half a second."""
OPTIONS: dict[str, dict[str, str]] = {
    "all that is new": {"sensors": "tactical", "navigation": "filtered"}
}
"""Options of flights beside their faults."""
IN_PROCESSES = {"late and lost"}
AHEAD = {topics.REFERENCE_JOINTS.full_name, topics.REFERENCE_BASE.full_name}
"""The mission of a graph sends its reference beyond the flight's end."""


def messages_by_topic(bag: Path) -> dict[str, list[bytes]]:
    found = defaultdict(list)
    for topic, message in messages_of(bag):
        found[topic.full_name].append(message)
    return found


@pytest.mark.parametrize("name", FLIGHTS)
def test_one_process_sends_what_the_graph_sends(
    name: str, fly: Callable[..., Flown], tmp_path: Path
) -> None:
    """Byte by byte: states with what is wrong with them, commands, telemetry, law and clock."""
    faults = list(FLIGHTS[name])
    hold = {"plant": {"hold_ticks": 100}, "controller": {"hold_ticks": 100}}
    given = OPTIONS.get(name, {})
    plan = FlightPlan.model_validate(
        {
            "duration": 0.5,
            "seed": SEED,
            "faults": faults,
            "swaps": [SWAP],
            "parameters": hold,
            **given,
        }
    )
    simulate(Flight(resolve(plan)), tmp_path / "bag")
    words = [word for fault in faults for word in ("--fault", fault)]
    for node in hold:
        words += ["--set", f"{node}.hold_ticks=100"]
    for option, value in given.items():
        words += [f"--{option}", value]
    if name not in IN_PROCESSES:
        words.append("--composed")
    flown = fly("--duration", "0.5", "--seed", str(SEED), "--swap", SWAP, *words)
    graph, own = messages_by_topic(flown.bag), messages_by_topic(tmp_path / "bag")
    assert own.keys() == graph.keys()
    for topic in own.keys() - AHEAD:
        assert own[topic] == graph[topic], topic


def test_every_fault_of_messages_is_compared() -> None:
    flown = {text.split("@")[0] for texts in FLIGHTS.values() for text in texts}
    assert set(MESSAGE_KINDS) < flown
