"""What a flight lacked: a held reference is never a silent success."""

from __future__ import annotations

import pytest

from space_robot.flight.graph.following import degradation

HELD = {"controller_node": {"tick": "5", "references_held": "300"}}
WORDS = ["controller_node held the reference for 300 ticks, for the mission's did not come"]


def test_a_whole_flight_lacks_nothing() -> None:
    nodes = {
        "controller_node": {"references_held": "0", "rejected: state not finite": "3"},
        "plant_node": {"refused: stamp": "1"},
    }
    assert degradation(nodes, frozenset(), realtime=False) == ([], [])


def test_a_held_reference_fails_a_flight_in_lockstep() -> None:
    assert degradation(HELD, frozenset({"kill_controller"}), realtime=False) == (WORDS, [])


def test_by_the_wall_clock_it_is_a_warning() -> None:
    assert degradation(HELD, frozenset(), realtime=True) == ([], WORDS)


@pytest.mark.parametrize("kind", ["kill_mission", "stop_mission"])
def test_where_the_mission_was_to_fail_it_is_expected(kind: str) -> None:
    assert degradation(HELD, frozenset({kind}), realtime=False) == ([], [])


def test_messages_that_others_have_sent_are_told() -> None:
    nodes = {
        "controller_node": {
            "rejected: another publisher's on /base/state": "7",
            "rejected: reference: names": "2",
            "rejected: stamp": "9",
        },
        "plant_node": {"refused: another publisher's on /command": "4"},
    }
    assert degradation(nodes, frozenset(), realtime=False).warnings == [
        "controller_node rejected: another publisher's on /base/state: 7 messages",
        "controller_node rejected: reference: names: 2 messages",
        "plant_node refused: another publisher's on /command: 4 messages",
    ]
