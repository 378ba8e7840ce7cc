"""Flights in one process whose messages fail, against the rules."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bags import messages_of
from flights import planned, simulated
from hypothesis import given, settings
from hypothesis import strategies as st
from matrix.scenarios import difference

from space_robot.flight.simulate import simulate
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.faults import MESSAGE_KINDS

NOTHING = "drop_state@0:0"
"""A fault of messages that never happens."""
TICKS = 200


def flown(*faults: str, bag: Path | None = None, **options: Any) -> FlightLog:
    return simulated(bag, faults=list(faults), **{"duration": TICKS * 5e-4, **options})


def test_lost_commands_hold_the_torque_and_then_there_is_none() -> None:
    log = flown("drop_command@0.02-0.07", parameters={"plant": {"hold_ticks": 50}})
    held, gone = log.applied_torque[41:90], log.applied_torque[91:141]
    np.testing.assert_array_equal(held, np.tile(held[0], (49, 1)))
    assert np.abs(held).max() > 0.0
    assert not gone.any()
    assert np.abs(log.applied_torque[141:]).max() > 0.0


def test_lost_states_have_no_command_and_are_filled() -> None:
    log = flown("drop_state@0.02-0.03")
    assert log.commanded_torque is not None
    assert np.flatnonzero(np.isnan(log.commanded_torque[:, 0])).tolist() == list(range(40, 60))
    assert (log.filled, log.unanswered, log.damage) == (20, 20, ())


@pytest.mark.parametrize("fault", ["kill_controller@0.05", "stop_mission@0.05:1"])
def test_processes_fail_in_a_graph_only(fault: str) -> None:
    with pytest.raises(InputError, match=rf"^faults \['{fault}'\]: that needs the graph of nodes"):
        flown(NOTHING, fault)


ARGUMENTS = {"P": ["0.02", "0.3", "1"], "TICKS": ["0", "1", "4"]}


@st.composite
def message_faults(draw: st.DrawFn) -> str:
    """One of any kind, in the first 0.09 s."""
    kind = draw(st.sampled_from(list(MESSAGE_KINDS.values())))
    start, stop = sorted(draw(st.lists(st.integers(0, 90), min_size=2, max_size=2, unique=True)))
    assert kind.argument
    argument = draw(st.sampled_from(ARGUMENTS[kind.argument.symbol]))
    return f"{kind.name}@{start / 1000}-{stop / 1000}:{argument}"


@settings(max_examples=8, deadline=None)
@given(st.lists(message_faults(), min_size=1, max_size=5), st.integers(0, 1000))
def test_whatever_fails_the_rules_hold(faults: list[str], seed: int) -> None:
    """The flight repeats, and no torque is wild, neither asked for nor applied."""
    log = flown(*faults, seed=seed)
    assert difference(log, flown(*faults, seed=seed)) == ""
    usual = np.abs(flown().applied_torque).max()
    for torque in (log.applied_torque, log.commanded_torque):
        assert torque is not None
        assert not np.any(np.abs(torque) > 100.0 * usual)


def test_the_bag_has_every_message_once_and_in_order(tmp_path: Path) -> None:
    flown("repeat_state@0:0.5", "jitter_state@0:2", "repeat_command@0", bag=tmp_path / "bag")
    found: dict[str, list[bytes]] = {}
    for topic, message in messages_of(tmp_path / "bag"):
        found.setdefault(topic.full_name, []).append(message)
    for topic in (topics.JOINT_STATES, topics.BASE_STATE, topics.COMMAND):
        assert len(set(found[topic.full_name])) == len(found[topic.full_name])
    assert len(found[topics.JOINT_STATES.full_name]) in range(TICKS - 2, TICKS + 1)
    assert len(found[topics.COMMAND.full_name]) < TICKS, "overtaken states are not answered"


def test_what_was_flown_here_is_trusted_and_its_progress_is_told(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    monkeypatch.setattr("space_robot.flight.simulate.STRETCH_OF_MESSAGES", 75)
    for bag in (None, tmp_path / "bag"):
        ticks: list[int] = []
        flight = planned(faults=[NOTHING], duration=TICKS * 5e-4)
        assert simulate(flight, bag, ticks.append).trusted
        assert ticks == [0, 75, 150, TICKS]
    assert flown().trusted
