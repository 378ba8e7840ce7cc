"""What the product has is in the matrix: a new law, fault or setting must be flown there."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from functools import cache
from typing import Any, Literal, get_args, get_origin

import pytest
from paths import CONFIG
from pydantic import BaseModel

from matrix.scenarios import CELLS, PLANS, in_root
from space_robot.flight.plan import Flight
from space_robot.scenario.faults import KINDS, PROCESS_KINDS
from space_robot.scenario.options import OPTIONS
from space_robot_control.guidance.goals import GoalFrame, Point
from space_robot_control.guidance.segments import (
    BASE_KINDS,
    SEGMENT_KINDS,
    Segment,
    ToolSegment,
    read_pointing,
    read_segments,
)
from space_robot_control.laws import laws
from space_robot_model.robot.parts import Encoder
from space_robot_sim.environment.events import FORMS

NO_FLIGHT_S_OWN = {
    "compression": "of the bag",
    "split_size": "of the bag",
    "controller_code": "the cell c",
    "shadow": "the cell c",
    "navigation_sensors": "sensors that are assumed are those that fly",
    "telemetry": "tests/laboratory/ground",
    "telemetry_packets": "tests/laboratory/ground",
}
OF_THE_GRAPH = {
    *("period", "fifo_priority", "ticks", "realtime", "paused", "reset_with", "own_controller"),
    *("silence_timeout", "join_timeout", "listener_timeout", "reference_timeout", "state_timeout"),
    *("wait_for", "goto"),
}
"""Settings that no flight in this process has (``period``: that of all nodes)."""


@cache
def flights() -> dict[str, Flight]:
    """All flights of the matrix, not flown."""
    with in_root():
        return {name: plan.scenario.check() for name, plan in PLANS.items()}


def lacking(wanted: Iterable[Any], there: Iterable[Any]) -> list[Any]:
    """Return what is wanted and not there."""
    return sorted({*wanted} - {*there}, key=str)


def in_config(folder: str) -> set[str]:
    """Return the names of shipped files."""
    return {file.stem for file in (CONFIG / folder).glob("*.yaml")}


@pytest.mark.parametrize(
    ("option", "folder"),
    [
        ("case", "cases"),
        ("sensors", "sensors"),
        ("actuators", "actuators"),
        ("orbit", "orbits"),
        ("robot", "robots"),
    ],
)
def test_all_that_is_shipped_flies(option: str, folder: str) -> None:
    chosen = {getattr(plan.scenario, option) for plan in PLANS.values()}
    assert lacking(in_config(folder), chosen) == []


def test_every_option_is_used() -> None:
    used = {name for plan in PLANS.values() for name in plan.options}
    flown = [name for name, option in OPTIONS.items() if not option.needs_graph]
    assert lacking(flown, used | NO_FLIGHT_S_OWN.keys()) == []


def test_every_law_answers() -> None:
    """From the start or after a swap; with constant and with nominal inertia."""
    answering = [
        law
        for flight in flights().values()
        for law in (flight.law, *(law for tick, law in flight.swaps if tick < flight.ticks))
    ]
    assert lacking(laws(), (law.name for law in answering)) == []
    assert len({law.estimate for law in answering}) > 1


def test_every_fault_happens() -> None:
    """In a flight that is not over yet; those of processes need a graph."""
    happening = {
        fault.kind.name
        for flight in flights().values()
        for fault in flight.plant_settings.parsed_faults
        if fault.start_s < flight.ticks * flight.period
    }
    assert lacking(KINDS.keys() - PROCESS_KINDS.keys(), happening) == []


def test_every_event_happens() -> None:
    words = {form.split("@")[0] for form in FORMS}
    events = [e for flight in flights().values() for e in flight.plant_settings.events if e]
    assert lacking(words, (event.split("@")[0] for event in events)) == []
    for target in in_config("targets"):
        assert any(target in event for event in events), target


def begun(flight: Flight) -> Iterator[Segment]:
    """The segments that have begun before the flight is over."""
    time = 0.0
    for segment in read_segments(flight.mission_settings.segments):
        if time < flight.ticks * flight.period:
            yield segment
        time += segment.span or 0.0


def test_every_kind_of_segment_is_flown() -> None:
    settings = [flight.mission_settings for flight in flights().values()]
    segments = [segment for flight in flights().values() for segment in begun(flight)]
    for kind in SEGMENT_KINDS.values():
        if kind.key != "trajectory":  # what a file becomes
            flown = [segment for segment in segments if type(segment) is kind]
            for key in {*kind.allowed_keys()} - {"base", "duration"}:
                assert any(getattr(segment, key) for segment in flown), (kind.key, key)
    assert any(segment.span is None for segment in segments), "fast"
    assert any(segment.is_base_free for segment in segments)
    tools = [segment.tool for segment in segments if isinstance(segment, ToolSegment)]
    assert lacking(get_args(GoalFrame), (tool.frame for tool in tools)) == []
    assert {tool.least for tool in tools} == {"motion", "momentum"}
    bases = [s.base for s in segments if s.base and not s.is_base_free]
    bases += [read_pointing(s.base_point, "start") for s in settings if s.base_point.strip()]
    assert lacking(BASE_KINDS.values(), map(type, bases)) == []
    assert lacking(get_args(Point), (getattr(base, "point", "") for base in bases)) == []


def leaves(model: BaseModel, prefix: str = "") -> Iterator[tuple[str, Any, Any, Any]]:
    """Dotted name, value, default and type of all settings."""
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if isinstance(value, BaseModel):
            yield from leaves(value, f"{prefix}{name}.")
        else:
            default = field.get_default(call_default_factory=True)
            yield prefix + name, value, default, field.annotation


def test_every_setting_differs_from_its_default_in_a_flight() -> None:
    """And has each of its words, where it has some."""
    missing: dict[str, set[Any]] = {}
    for flight in flights().values():
        for node in ("plant", "controller", "mission"):
            for name, value, default, kind in leaves(getattr(flight, f"{node}_settings")):
                choices = get_args(kind) if get_origin(kind) is Literal else (True,)
                is_used = value if get_origin(kind) is Literal else value != default
                missing.setdefault(f"{node}.{name}", {*choices}).discard(is_used)
    left = {name: words for name, words in missing.items() if words}
    exempt = OF_THE_GRAPH | NO_FLIGHT_S_OWN.keys()
    assert {n: w for n, w in left.items() if n.split(".", 1)[1] not in exempt} == {}


def test_every_shape_of_robot_flies() -> None:
    """Joints that turn and slide, with motors and without; gears, plates, arms, tools, a URDF."""
    robots = [flight.scenario.robots.plant for flight in flights().values()]
    kinds = {(bool(kind), k < r.n) for r in robots for k, kind in enumerate(r.is_prismatic)}
    assert len(kinds) == 4
    gears = [gear for robot in robots for gear in robot.gears if gear]
    assert lacking(get_args(Encoder), (gear.encoder for gear in gears)) == []
    assert any(robot.plates for robot in robots)
    assert {len(robot.branches) for robot in robots} >= {1, 2}
    assert any(len(robot.tools) > 1 for robot in robots)
    assert any(robot.source.endswith(".urdf") for robot in robots)


def test_cells_that_lack_have_a_reason() -> None:
    for plan in PLANS.values():
        assert lacking(plan.lacking, CELLS) == []
        assert all(len(reason) > 10 for reason in plan.lacking.values())
        assert plan.why
