"""The remark before a flight on gains with too little margin."""

from __future__ import annotations

import pytest

from space_robot.cli.options import remarks_on
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.gain_check import pair_corner
from space_robot.tuning.warning import margin_remarks
from space_robot_control.controller.settings import ControllerNodeSettings


def remarks(plan: FlightPlan, corner: float = 0.0) -> list[str]:
    flight = Flight(resolve(plan))
    laws = [flight.law, *(law for _, law in flight.swaps)]
    return margin_remarks(
        laws,
        flight.plant.robot,
        flight.mission_settings,
        corner,
        flight.controls_base,
        nominal=flight.robot,
    )


def with_h_bar(*values: float, law: str = "tde_stc") -> FlightPlan:
    parameters = {"controller": {f"{law}.h_bar": list(values)}}
    return FlightPlan(controller=law, parameters=parameters)


def test_table_iv_is_remarked_upon_once_a_law() -> None:
    (line,) = remarks(FlightPlan(swaps=["1:tde_stc"]))
    assert line.startswith("warning: tde_stc: h_bar leaves 0.31% of margin in torque scale")
    assert line.endswith("see space-robot gains check")
    both = remarks(FlightPlan(swaps=["1:tde_smc", "2:ctc"]))
    assert [text.split(":")[1] for text in both] == [" tde_stc", " tde_smc"]


def test_nobody_is_warned_of_the_default_gains_unless_the_flight_tries_their_margin() -> None:
    """Who has chosen nothing is not greeted with a warning; who has tried something is."""
    h_bar = {"controller": {"tde_stc.h_bar": [50.0] * 3 + [5.0] * 3 + [0.5] * 3}}
    for plan, count in (
        (FlightPlan(), 0),
        (FlightPlan(case="3", sensors="fine"), 0),
        (FlightPlan(gains="printed"), 1),
        (FlightPlan(parameters=h_bar), 1),
        (FlightPlan(gains={"h_bar": h_bar["controller"]["tde_stc.h_bar"]}), 1),
        (FlightPlan(faults=["torque_scale@2:base=0.99"]), 1),
        (FlightPlan(actuators="wheels"), 1),
    ):
        assert len(remarks_on(Flight(resolve(plan)))) == count, plan
    (line,) = remarks_on(Flight(resolve(with_h_bar(*[50.0] * 3, *[5.0] * 3, *[1.0] * 3))))
    assert "diverge" in line


def test_thrusters_are_told_which_gains_are_for_them() -> None:
    for actuators, is_said in (("thrusters", True), ("wheels_and_thrusters", False)):
        (line,) = remarks_on(Flight(resolve(FlightPlan(actuators=actuators))))
        assert ("thrusters' pulses" in line) is is_said
    assert remarks_on(Flight(resolve(FlightPlan(actuators="thrusters", gains="robust")))) == []


def test_an_h_bar_that_is_too_large_is_said_to_diverge() -> None:
    (line,) = remarks(with_h_bar(*[50.0] * 3, *[5.0] * 3, *[1.0] * 3))
    assert "too large" in line
    assert "diverge" in line
    assert "margin" in remarks(with_h_bar(*[50.0] * 3, *[5.0] * 3, *[1.0] * 3), corner=100.0)[0]


@pytest.mark.parametrize(
    ("own", "given", "corner"),
    [
        ("direct", {}, 0.0),
        ("direct", {"acceleration_filter_hz": 50.0}, 50.0),
        ("filtered", {}, 150.0),  # rates 100, joints 150 Hz: what passes the faster one
        ("filtered", {"acceleration_filter_hz": 50.0}, 50.0),
        ("filtered", {"navigation_filter.rate_filter_hz": 0.0}, 0.0),
    ],
)
def test_what_filters_the_pair_counts(own: str, given: dict[str, float], corner: float) -> None:
    settings = ControllerNodeSettings.resolve({"navigation": own, **given})
    assert pair_corner(settings) == corner


@pytest.mark.parametrize(
    ("inertia", "word"), [(2.0, "it will diverge"), (100.0, "margin in torque scale"), (400.0, "")]
)
def test_an_observer_of_too_little_inertia_is_remarked_upon(inertia: float, word: str) -> None:
    """Of ADRC by its loop: its observer's pole is at ``min(lambda) omega_o / 3``."""
    shape = [5.3, 2.8, 2.2, 0.067, 0.23, 0.19, 0.0053, 0.0056, 0.0012]
    own = {"inertia": [inertia * value for value in shape], "omega_c": [0.2], "omega_o": [400.0]}
    plan = FlightPlan(
        controller="adrc", parameters={"controller": {f"adrc.{k}": v for k, v in own.items()}}
    )
    found = remarks(plan)
    assert len(found) == bool(word)
    assert all(word in line and line.startswith("warning: adrc: ") for line in found)


def test_the_nominal_inertia_is_remarked_upon_where_a_payload_outweighs_it() -> None:
    flights = (("paper", "4-2", 0), ("seven_joint", "1", 0), ("seven_joint", "4-2", 1))
    for robot, case, count in flights:
        found = remarks(FlightPlan(controller="indi", robot=robot, case=case))
        assert len(found) == count
        assert all("nominal inertia leaves 1.87% of margin" in line for line in found)
