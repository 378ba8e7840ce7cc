"""What happened in a flight stands where it happened; what cannot be read is left out."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import pytest

from space_robot.analysis import excerpt
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.view.marks import Mark, marks_of, shared_marks
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight

CAPTURE = Mark(0.1, 0.1, "capture small_satellite", "event")
SCALE = Mark(0.15, 0.2, "drive_scale all=0.9", "fault")
STICK = Mark(0.18, math.inf, "stuck_joint 3=20", "fault")
SWAP = Mark(0.25, 0.25, "tde_stc -> ctc", "law")
RELEASE = Mark(0.28, 0.28, "release", "event")


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> FlightLog:
    bag = tmp_path_factory.mktemp("bags") / "marked"
    plan = FlightPlan(
        duration=0.3,
        swaps=["0.25:ctc"],
        events=["capture@0.1:small_satellite", "release@0.28"],
        faults=["stuck_joint@0.18:3=20", "drive_scale@0.15-0.2:all=0.9", "noise_gyro@2:1e-6"],
    )
    simulate(Flight(resolve(plan)), bag)
    return read_flight(bag)


def test_events_faults_and_laws_are_marked_by_time(log: FlightLog) -> None:
    assert marks_of(log) == [CAPTURE, SCALE, STICK, SWAP, RELEASE]


def test_of_an_excerpt_only_what_goes_on_in_it(log: FlightLog) -> None:
    assert marks_of(excerpt(log, 0.16, 0.24)) == [SCALE, STICK]
    assert marks_of(excerpt(log, 0.1, 0.14)) == [CAPTURE]  # it begins with the excerpt


def test_what_makes_no_sense_is_left_out(log: FlightLog) -> None:
    faults = ["drive_scale@0.15-0.2:all=0.9", "no_such@1", "", 7]
    broken = replace(log, laws=(), flight={"faults": faults, "events": ["capture@x", 3]})
    assert marks_of(broken) == [SCALE]


def test_what_not_all_flights_had_says_which(log: FlightLog) -> None:
    other = replace(log, flight={**log.flight, "faults": []})
    found = shared_marks({"one": log, "two": other})
    assert [mark.text for mark in found] == [
        CAPTURE.text,
        f"one: {SCALE.text}",
        f"one: {STICK.text}",
        SWAP.text,
        RELEASE.text,
    ]


def test_a_flight_of_others_has_no_marks(log: FlightLog, tmp_path: Path) -> None:
    assert marks_of(replace(log, laws=(), flight={})) == []
