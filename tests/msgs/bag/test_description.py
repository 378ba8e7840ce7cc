"""Descriptions of flights in bags: what the plant says; edited in any way, never a traceback."""

from __future__ import annotations

import io
import json
import sys
from pathlib import Path
from typing import Any

import pytest
from bags import redescribed
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from space_robot.analysis import analyze
from space_robot.analysis.report_tables import metrics_table, rms_table
from space_robot.cli.report_display import print_comparison
from space_robot.console.terminal import print_table, terminal
from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.flight.replay.choice import ControllerChoice
from space_robot.flight.replay.recording import Recording
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.description import read_description
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.recorder import BagRecorder
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

fuzzed = settings(max_examples=25, suppress_health_check=list(HealthCheck))
MODULE = "this"
"""Importing it prints, and it is in no one's way."""
PLAN = Scenario(duration=0.02, swaps=["0.005:ctc"], case="3", actuators="wheels")
DESCRIPTION = json.dumps(Flight(resolve(PLAN)).description)
TEXTS = (
    *(r"$\frac$", "[/red]", "$", ":smile:", "<b>&amp;", "[bold]", "\\", "{}", "%s", "夏"),
    *("ctc", "seven_joint", "nan", "0.01:ctc", "/etc/passwd", "../../x.yaml", "", ".."),
    *("a" * 400, "\x1b[31m", "\ud800", "\x00", f"0.1:{MODULE}:X"),
)
NUMBERS = (0, -1, 1e300, 1e-300, 10**400, float("nan"), float("inf"), -0.0, 2**64)
scalars = st.one_of(
    st.none(),
    st.booleans(),
    st.integers(),
    st.floats(),
    st.text(max_size=12),
    st.sampled_from([*NUMBERS, *TEXTS]),
)
values = st.recursive(
    scalars,
    lambda inner: st.one_of(
        st.lists(inner, max_size=9), st.dictionaries(st.text(max_size=9), inner, max_size=3)
    ),
    max_leaves=9,
)
edits = st.tuples(
    st.sampled_from(["put", "put", "put", "delete", "add"]),
    st.floats(0, 1, exclude_max=True),
    st.integers(0, 2**20),
    values,
)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("described") / "bag"
    simulate(Flight(resolve(PLAN)), path)
    return path


def places(value: Any) -> list[tuple[Any, Any]]:
    """Every container in a value, with each of its keys, those near the top first."""
    found, waiting = [], [value]
    while waiting:
        container = waiting.pop(0)
        keys = container if isinstance(container, dict) else range(len(container))
        for key in keys:
            found.append((container, key))
            if isinstance(container[key], (dict, list)):
                waiting.append(container[key])
    return found


def edited(description: Any, changes: list[tuple[str, float, int, Any]]) -> Any:
    for kind, depth, place, value in changes:
        if not isinstance(description, (dict, list)) or not (there := places(description)):
            return value
        nearest = there[: max(1, int(len(there) * depth**3))]  # numbers of the robot are the most
        container, key = nearest[place % len(nearest)]
        if kind == "delete":
            del container[key]
        elif kind == "add" and isinstance(container, dict):
            container[f"new_{place}"] = value
        else:
            container[key] = value
    return description


def try_replay(bag: Path) -> None:
    """As far as the controller's start."""
    try:
        choice = ControllerChoice(Recording(bag).flight)
    except InputError as error:
        assert str(error).isprintable()  # noqa: PT017
    else:
        assert choice.robot.n


@fuzzed
@given(st.lists(edits, min_size=1, max_size=3))
def test_an_edited_description_is_told_or_followed(
    bag: Path, changes: list[tuple[str, float, int, Any]]
) -> None:
    redescribed(bag, json.dumps(edited(json.loads(DESCRIPTION), changes)))
    log = read_flight(bag)
    assert log.ticks == 40
    assert all(text.isprintable() for text in log.damage)
    report = analyze(log)
    for console in (terminal(file=io.StringIO(), width=width) for width in (20, 100)):
        print_table(rms_table(report), console)
        print_table(metrics_table(report), console)
        print_comparison({"[/red]": report, r"$\frac": report}, console)
    try_replay(bag)
    assert MODULE not in sys.modules


@fuzzed
@given(st.text(max_size=30) | st.sampled_from(["[" * 100_000, '{"a":' * 500 + "1" + "}" * 500]))
def test_what_is_no_json_is_told(bag: Path, text: str) -> None:
    redescribed(bag, text)
    (told,) = read_flight(bag).damage
    assert told.startswith("the description of the flight cannot be")
    try_replay(bag)


@pytest.mark.parametrize(
    "changes",
    [
        {"period": 0},
        {"period": 1e300},
        {"scenario": [3]},
        {"swaps": [1]},
        {"command_latency_ticks": "2"},
    ],
)
def test_each_wrong_key_is_named_in_a_line(bag: Path, changes: dict[str, Any]) -> None:
    redescribed(bag, json.dumps({**json.loads(DESCRIPTION), **changes}))
    (key,) = changes
    log = read_flight(bag)
    assert log.flight == {}
    (told,) = log.damage
    assert told.startswith(f"the description of the flight cannot be used: {key}")
    assert told.isprintable()
    with pytest.raises(InputError, match=f"cannot be used: {key}"):
        Recording(bag)


def test_keys_of_newer_software_are_no_fault(bag: Path) -> None:
    described = {**json.loads(DESCRIPTION), "orbit": {"altitude": 4e5}}
    redescribed(bag, json.dumps(described))
    log = read_flight(bag)
    assert (log.damage, log.flight["orbit"]) == ((), {"altitude": 4e5})


# What the plant says, where the recorder was not told

FLOWN = {"robot": "mine", "robot_file": {"robot": {"name": "mine"}}, "period": 0.001}
TOLD = {"robot": "paper", "robot_file": {"robot": {"name": "paper"}}}


@pytest.mark.parametrize(
    ("told", "said", "expected"),
    [
        ({"period": 0.0005}, FLOWN, {**FLOWN, "period": 0.0005}),
        (TOLD, {**FLOWN, "faults": ["drop_state@1"]}, TOLD),
        *(({"period": 0.0005}, odd, {"period": 0.0005}) for odd in (None, [], "robot", 3.0)),
    ],
)
def test_what_the_plant_says_is_in_the_bag_and_what_the_recorder_was_told_counts(
    tmp_path: Path, told: dict[str, Any], said: object, expected: dict[str, Any]
) -> None:
    bag = BagRecorder(tmp_path / "bag", told, Timebase(500_000))
    bag.describe(said)
    for _ in range(2):  # of an unfinished bag, and of one that is
        assert read_description(open_bag(tmp_path / "bag").custom_data()) == expected
        bag.close()
