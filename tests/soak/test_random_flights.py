"""Drawn flights: valid, the same again, of every kind, mild enough to be flown."""

from __future__ import annotations

import shlex

import click
import pytest
from flight_verdict import unplanned_deaths
from hypothesis import given
from hypothesis import strategies as st
from process_monitor import node_of
from random_flights import (
    ACTUATORS,
    BREAKING,
    CASES,
    LONGEST_S,
    MOST_FAULTS,
    SHORTEST_S,
    SILENCE_S,
    SILENCING,
    breaks_tracking,
    command_line,
    sample_flight,
)

from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.scenario.faults import KINDS
from space_robot_control.laws import laws
from space_robot_sim.faults.axes import About
from space_robot_sim.faults.grammar import Fault, parse_faults

SEEDS = st.integers(0, 2**63)
NUMBERS = st.integers(0, 10**9)
DURATIONS = st.floats(SHORTEST_S, 1e4)
SAME_AS_FLY = {
    "gains": "default",
    "robot": "paper",
    "mission": "",
    "friction": True,
    "realtime": False,
    "command_latency_ticks": 0,
    "parameters": {},
}
MANY = [sample_flight(0, number) for number in range(1000)]


def faults(number: int) -> list[Fault]:
    return parse_faults(MANY[number].faults, KINDS)


@given(SEEDS, NUMBERS, DURATIONS)
def test_every_drawn_plan_is_a_flight(seed: int, number: int, duration_s: float) -> None:
    plan = sample_flight(seed, number, duration_s)
    flight = Flight(resolve(plan))
    assert 1 <= len(plan.faults) <= MOST_FAULTS
    end_s = flight.ticks * flight.period
    assert all(tick * flight.period < end_s for tick, _ in flight.swaps)
    for fault in parse_faults(plan.faults, KINDS):
        assert 0.0 < fault.start_s < end_s
        assert not fault.kind.lasts or fault.stop_s <= end_s + 0.001


@given(SEEDS, NUMBERS, DURATIONS)
def test_a_number_is_always_the_same_flight(seed: int, number: int, duration_s: float) -> None:
    assert sample_flight(seed, number, duration_s) == sample_flight(seed, number, duration_s)


def test_numbers_and_seeds_are_different_flights() -> None:
    assert len({plan.model_dump_json() for plan in MANY}) == len(MANY)
    assert sample_flight(1, 1) != sample_flight(2, 1)


def test_everything_is_drawn() -> None:
    drawn = [fault.kind.name for number in range(len(MANY)) for fault in faults(number)]
    assert set(drawn) == set(KINDS)
    assert {plan.controller for plan in MANY} == set(laws())
    assert {plan.case for plan in MANY} == set(CASES)
    assert {plan.actuators for plan in MANY} == set(ACTUATORS)
    assert {len(plan.faults) for plan in MANY} == set(range(1, MOST_FAULTS + 1))
    assert any(plan.swaps for plan in MANY)


def test_faults_are_such_that_a_flight_can_end() -> None:
    for number in range(len(MANY)):
        for fault in faults(number):
            argument, length_s = fault.kind.argument, fault.stop_s - fault.start_s
            symbol = argument.symbol if argument else ""
            if symbol == "P" and fault.value == 1.0:
                assert fault.kind.name in SILENCING
                assert length_s <= SILENCE_S + 1e-9
            elif symbol in ("P", "TICKS", "SECONDS"):
                assert fault.value <= {"P": 0.1, "TICKS": 3.0, "SECONDS": 3.0}[symbol]
            elif symbol in ("SIGMA", "STEP"):
                assert fault.value <= (1e-5 if fault.kind.name == "noise_joint_velocity" else 1e-6)
            if fault.kind.name in LONGEST_S:
                assert length_s <= LONGEST_S[fault.kind.name] + 1e-9


def test_faults_begin_within_the_middle_eight_tenths() -> None:
    """From the first tenth of a flight to the last, both reached within a hundredth."""
    starts = [f.start_s / MANY[k].duration for k in range(len(MANY)) for f in faults(k)]
    assert 0.1 - 1e-9 <= min(starts) < 0.11
    assert 0.89 < max(starts) <= 0.9 + 1e-9


def test_a_process_that_stays_dead_fails_once() -> None:
    for plan in MANY:
        kinds = [text.partition("@")[0] for text in plan.faults]
        for node in ("recorder", "mission"):
            assert sum(kind.endswith(f"_{node}") for kind in kinds) <= 1


def test_tracking_breaks_where_torque_or_reference_are_taken_away() -> None:
    assert set(BREAKING) <= set(KINDS)
    plan = MANY[0]
    for text in (
        "kill_controller@1",
        "stop_mission@1:1",
        "saturate_base@1:0.1",
        "drop_state@1-1.2",
    ):
        assert breaks_tracking(plan.model_copy(update={"faults": [text]})), text
    for text in ("drop_state@1:0.1", "noise_gyro@1:1e-7", "kill_recorder@2", "stop_recorder@1:2"):
        assert not breaks_tracking(plan.model_copy(update={"faults": [text]})), text


@given(SEEDS, NUMBERS)
def test_the_command_line_flies_the_same_plan(seed: int, number: int) -> None:
    plan = sample_flight(seed, number)
    program, name, *words = shlex.split(command_line(plan))
    assert (program, name) == ("space-robot", "fly")
    command = cli.commands["fly"]
    parsed = command.make_context("fly", words, parent=click.Context(cli)).params
    for key in ("controller", "case", "actuators", "duration", "seed", "restart_controller"):
        assert parsed[key] == getattr(plan, key), key
    assert list(parsed["faults"]) == plan.faults
    assert list(parsed["swaps"]) == plan.swaps
    for key, value in SAME_AS_FLY.items():
        assert parsed[key] == getattr(plan, key) == value, key


def event(node: str, what: str) -> dict[str, object]:
    return {"simulated_s": 1.0, "node": f"{node}_node", "what": what}


def test_deaths_beyond_the_planned_ones_are_told() -> None:
    killed = event("controller", "controller ended by signal 9")
    crashed = event("controller", "controller ended with exit code 1")
    assert unplanned_deaths(["kill_controller"], [killed]) == []
    assert unplanned_deaths([], [crashed]) == ["controller ended with exit code 1, deaths: 1"]
    assert len(unplanned_deaths(["kill_controller", "drop_state"], [killed, crashed])) == 1
    assert len(unplanned_deaths(["stop_mission"], [event("mission", "mission ended by ...")])) == 1
    hung = event("controller", "does not answer")
    assert unplanned_deaths(["stop_controller"], [hung]) == []
    assert unplanned_deaths(["kill_controller"], [killed, hung]) == ["controller hung"]


def test_a_process_is_known_by_its_command_line() -> None:
    wait = 'wait_for:=["plant_node"]'
    assert node_of(["python", "-m", "space_robot_sim.plant_node", "--ros-args"]) == "plant"
    assert node_of(["python", "/ws/lib/space_robot/controller_node", "-p", wait]) == "controller"
    assert node_of(["ros2", "run", "space_robot", "mission_node"]) == "mission"
    assert node_of(["python", "-c", "pass", wait]) == ""


@pytest.mark.parametrize("actuators", ACTUATORS)
def test_actuators_have_as_many_wheels_and_thrusters_as_faults_are_drawn_for(
    actuators: str,
) -> None:
    settings = Flight(resolve(FlightPlan(actuators=actuators))).plant_settings
    counts = {About.WHEEL: settings.wheel_count, About.THRUSTER: settings.thruster_count}
    assert {about: count for about, count in counts.items() if count} == ACTUATORS[actuators]
