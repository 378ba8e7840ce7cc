"""All metrics of a flight at once: cut into blocks anywhere they are those of the whole flight."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from space_robot import Scenario
from space_robot.analysis import Analysis
from space_robot_msgs_py.bag.flight_log import FlightLog

TICKS = 6000


@pytest.fixture(scope="module")
def log() -> FlightLog:
    """Sensors, wheels at their limits, a filter, a swap and a capture: whatever metrics there are.

    The attitude is nowhere at identity.
    """
    flight = (
        Scenario(
            controller="tde_stc",
            case="3",
            sensors="fine",
            navigation="filtered",
            actuators="small_wheels",
            swaps=["1.5:tde_smc"],
            duration=TICKS * 0.0005,
            events=["capture@1:small_satellite"],
            mission={
                "waypoint_times": [0.0, 2.5],
                "waypoints_deg": [10.0] * 6 + [30.0] * 6,
                "base_quaternion": [0.6, 0.48, 0.64, 0.0],
            },
        )
        .fly()
        .check()
    )
    return flight.log


def numbers(report: Any, path: str = "") -> dict[str, Any]:
    """Return the leaves of a report by their paths."""
    if isinstance(report, dict):
        inner = [numbers(value, f"{path}.{key}") for key, value in report.items()]
    elif isinstance(report, (list, tuple)):
        inner = [numbers(value, f"{path}[{k}]") for k, value in enumerate(report)]
    else:
        return {path: report}
    return {name: value for part in inner for name, value in part.items()}


@pytest.mark.parametrize("cuts", [[TICKS - 1], [1], [2999, 3001], [2, 3, TICKS - 2, TICKS - 1]])
def test_a_report_does_not_depend_on_the_blocks(log: FlightLog, cuts: list[int]) -> None:
    whole, parts = Analysis(), Analysis()
    whole.add(log)
    for start, stop in zip([0, *cuts], [*cuts, log.ticks], strict=True):
        parts.add(log.rows(start, stop))
    expected, found = numbers(whole.report()), numbers(parts.report())
    assert list(found) == list(expected)
    for name, value in expected.items():
        if isinstance(value, float):
            np.testing.assert_allclose(found[name], value, rtol=1e-6, atol=1e-15, err_msg=name)
        else:
            assert found[name] == value, name
