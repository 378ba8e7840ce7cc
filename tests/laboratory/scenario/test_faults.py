"""The grammar of faults, what is said of bad ones, and the page of kinds against the catalogue."""

from __future__ import annotations

import math
import re

import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import DOCS

from space_robot.scenario.faults import KINDS, PROCESS_KINDS
from space_robot_msgs_py.errors import InputError
from space_robot_sim.faults.grammar import Fault, Kind, help_lines, parse_fault, parse_faults
from space_robot_sim.plant.settings import PLANT_KINDS

TIMES = st.floats(0.0, 1e9)


@st.composite
def arguments(draw: st.DrawFn, kind: Kind) -> str:
    """Any that the kind allows, none included."""
    argument = kind.argument
    if argument is None or (kind.default is not None and draw(st.booleans())):
        return ""
    if argument.whole:
        return str(draw(st.integers(int(argument.low), int(argument.high))))
    axes = st.integers(1, 99).map(str) | st.sampled_from(["base_x", "joint2", "joints", "a=b"])
    if not argument.symbol:
        return draw(axes)
    number = repr(draw(st.floats(argument.low, argument.high)))
    return f"{draw(axes)}={number}" if argument.about else number


@st.composite
def faults(draw: st.DrawFn) -> Fault:
    """Any fault there is."""
    kind = draw(st.sampled_from(list(KINDS.values())))
    start, stop = sorted(draw(st.lists(TIMES, min_size=2, max_size=2, unique=True)))
    lasting = not kind.lasts or draw(st.booleans())
    return Fault(kind, start, math.inf if lasting else stop, draw(arguments(kind)))


@given(faults())
def test_a_fault_is_its_text(fault: Fault) -> None:
    """There and back without loss, whatever the times and the argument."""
    assert parse_fault(str(fault), KINDS) == fault
    assert str(parse_fault(str(fault), KINDS)) == str(fault)


@pytest.mark.parametrize(
    ("text", "fault", "axis", "value"),
    [
        ("drop_state@2.0:0.1", Fault(KINDS["drop_state"], 2.0, math.inf, "0.1"), "", 0.1),
        ("noise_gyro@1e-3-2e-3:0", Fault(KINDS["noise_gyro"], 0.001, 0.002, "0"), "", 0.0),
        ("stuck_joint@5:3=20", Fault(KINDS["stuck_joint"], 5.0, math.inf, "3=20"), "3", 20.0),
        ("encoder_stuck@5:3", Fault(KINDS["encoder_stuck"], 5.0, math.inf, "3"), "3", math.nan),
        ("delay_state@0", Fault(KINDS["delay_state"], 0.0, math.inf, ""), "", 1.0),
        ("stop_controller@2:1.5", Fault(KINDS["stop_controller"], 2.0, math.inf, "1.5"), "", 1.5),
        (" stop_mission@.5 ", Fault(KINDS["stop_mission"], 0.5, math.inf, ""), "", math.inf),
    ],
)
def test_given_texts(text: str, fault: Fault, axis: str, value: float) -> None:
    assert parse_fault(text, KINDS) == fault
    assert fault.axis == axis
    assert fault.value == pytest.approx(value, nan_ok=True)


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("drop_state", "KIND@T"),
        ("drop_state@-1", "KIND@T"),
        ("drop_state@2s", "KIND@T"),
        ("drop_state@nan", "KIND@T"),
        ("drop_state@2:", "KIND@T"),
        ("drop_state@2-1", "END must be later than T, got 2 to 1"),
        ("drop_state@1e999", "T must be from 0 to"),
        ("drop@2", "unknown kind 'drop': did you mean drop_state"),
        ("drop_state@2:1.1", r"argument '1\.1': P, a number from 0 to 1 \(probability per tick\)"),
        ("drop_state@2:-0.1", "a number from 0 to 1"),
        ("drop_state@2:nan", "a number from 0 to 1"),
        ("drop_state@2:1=0.5", "a number from 0 to 1"),
        ("delay_state@2:1.5", r"TICKS, a whole number from 0 to 1e\+06 \(ticks\)"),
        ("noise_gyro@2", r"noise_gyro needs an argument: SIGMA, a number .* \(rad/s\)"),
        ("quantise_gyro@2:0", "STEP, a number from 1e-12"),
        ("stuck_joint@2:20", "JOINT=TORQUE, .* counted from 1"),
        ("stuck_joint@2:3=x", "JOINT=TORQUE, .* counted from 1"),
        ("encoder_stuck@2", "encoder_stuck needs an argument: JOINT a name, counted from 1"),
        ("gyro_bias@2:1e-5", "BASE_AXIS=RATE, .* BASE_AXIS a name, or base"),
        ("tracker_blind@2:1", "tracker_blind takes no argument, got '1'"),
        ("kill_controller@2:1", "kill_controller takes no argument, got '1'"),
        ("kill_controller@2-3", "kill_controller has no end: kill_controller@T"),
    ],
)
def test_bad_texts_are_named_with_what_is_allowed(text: str, why: str) -> None:
    with pytest.raises(InputError, match=f"^fault '{re.escape(text)}': .*{why}") as caught:
        parse_fault(text, KINDS)
    assert "\n" not in str(caught.value)


def test_a_kind_of_another_place_is_refused_and_an_empty_text_is_none() -> None:
    with pytest.raises(InputError, match=r"unknown kind 'kill_mission'"):
        parse_fault("kill_mission@2", PLANT_KINDS)
    with pytest.raises(InputError, match=r"'drop_state'.*choose one of kill_controller"):
        parse_fault("drop_state@2", PROCESS_KINDS)
    assert [str(f) for f in parse_faults(["", "nan_state@1", " "], KINDS)] == ["nan_state@1"]


def test_help_has_every_kind_and_its_form() -> None:
    lines = help_lines(PLANT_KINDS)
    assert len(lines) == len(PLANT_KINDS)
    assert "drop_state@T[-END][:P]" in lines[0]
    assert any(line.startswith("stuck_joint@T[-END]:JOINT=TORQUE ") for line in lines)
    assert {line.split("@")[0] for line in help_lines(KINDS)} == set(KINDS)


def test_every_example_of_the_page_is_one_of_its_kind() -> None:
    page = (DOCS / "reference/faults.md").read_text("utf-8")
    examples = re.findall(r"^\| `(\w+)@.* `([^`]+)` \|$", page, re.MULTILINE)
    assert [kind for kind, _ in examples] == list(KINDS)
    for kind, example in examples:
        assert parse_fault(example, KINDS).kind is KINDS[kind]


def test_every_default_argument_is_one_that_is_allowed() -> None:
    for kind in KINDS.values():
        if kind.argument is None or kind.default is None:
            continue
        assert kind.default == math.inf or kind.argument.low <= kind.default <= kind.argument.high
        assert kind.argument.symbol != "P" or kind.default == 1.0, kind.name
