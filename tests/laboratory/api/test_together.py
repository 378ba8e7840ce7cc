"""`space_robot.fly_many`: several flights at a time, in their order, whatever becomes of each."""

from __future__ import annotations

from typing import Any

import pytest

import space_robot as sr
from space_robot_msgs_py.errors import InputError


def proportional(signals: Any) -> Any:
    return 100.0 * signals.error + 20.0 * signals.error_rate


@pytest.mark.filterwarnings("ignore:the start")
def test_each_is_the_flight_alone_in_the_given_order() -> None:
    """Of two batches, one in plain Python, one that ends early."""
    common: dict[str, Any] = {"duration": 0.05, "sensors": "fine"}
    scenarios = [
        sr.Scenario(**common),
        sr.Scenario(**common, controller="ctc"),
        sr.Scenario(**common, seed=3),
        sr.Scenario(**common, controller=proportional),
        sr.Scenario(**common, controller="ctc", case="3"),
        sr.Scenario(**common, faults=["torque_scale@0:all=0.05"]),
    ]
    over: list[int] = []
    flights = sr.fly_many(scenarios, progress=over.append)
    dropped = sr.fly_many(scenarios, keep_log=False)
    assert over[-1] == len(flights) == 6
    for flight, other, scenario in zip(flights, dropped, scenarios, strict=True):
        alone = scenario.fly()
        assert flight.report() == alone.report()
        assert flight.outcome == alone.outcome
        assert flight.log.quaternion.tobytes() == alone.log.quaternion.tobytes()
        assert other.metrics == flight.metrics
        with pytest.raises(InputError, match="no log was kept"):
            _ = other.log
    assert sr.fly_many([]) == []
