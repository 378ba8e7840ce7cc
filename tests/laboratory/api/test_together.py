"""`space_robot.fly_many`: the flights of `Scenario.fly`, several at a time."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import space_robot as sr
from space_robot_msgs_py.errors import InputError


def scenarios() -> list[sr.Scenario]:
    """Of two batches, one in plain Python, one that ends early."""
    common: dict[str, Any] = {"duration": 0.05, "sensors": "fine"}
    return [
        sr.Scenario(**common),
        sr.Scenario(**common, controller="ctc"),
        sr.Scenario(**common, seed=3),
        sr.Scenario(**common, controller=proportional),
        sr.Scenario(**common, controller="ctc", case="3"),
        sr.Scenario(**common, faults=["torque_scale@0:all=0.05"]),
    ]


def proportional(signals: Any) -> Any:
    return 100.0 * signals.error + 20.0 * signals.error_rate


@pytest.mark.filterwarnings("ignore:the start")
def test_each_is_the_flight_alone_in_the_given_order() -> None:
    over: list[int] = []
    flights = sr.fly_many(scenarios(), progress=over.append)
    assert over[-1] == len(flights) == 6
    for flight, scenario in zip(flights, scenarios(), strict=True):
        alone = scenario.fly()
        assert flight.report() == alone.report()
        assert flight.outcome == alone.outcome
        for name, column in alone.log.columns.items():
            np.testing.assert_array_equal(flight.log.columns[name], column, name)


@pytest.mark.filterwarnings("ignore:the start")
def test_metrics_alone_need_no_log() -> None:
    kept, dropped = (sr.fly_many(scenarios(), keep_log=keep) for keep in (True, False))
    for one, other in zip(kept, dropped, strict=True):
        assert one.metrics == other.metrics
        with pytest.raises(InputError, match="no log was kept"):
            _ = other.log


def test_no_scenarios_are_no_flights() -> None:
    assert sr.fly_many([]) == []


@pytest.mark.parametrize(
    ("given", "said"),
    [
        ([sr.Scenario(), 3], "scenario 1: a Scenario was expected, got 3"),
        ([sr.Scenario(robot="no_such")], "scenario 0: .*no_such"),
        ([sr.Scenario(controller=None)], "scenario 0: controller is None"),
    ],
)
def test_a_wrong_one_is_named(given: list[Any], said: str) -> None:
    with pytest.raises(InputError, match=said):
        sr.fly_many(given)


def test_progress_is_a_function() -> None:
    with pytest.raises(InputError, match=r"progress: a function was expected, .*, got 7"):
        sr.fly_many([], progress=7)  # type: ignore[arg-type]
