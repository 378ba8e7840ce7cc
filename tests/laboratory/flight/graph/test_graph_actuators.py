"""Wheels and thrusters on the real graph: the flight that `simulate` flies, and replay, to the bit.

Their states go the plant's way to the controller as the joints' and the base's do.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from flights import Flown

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.replay.outcome import ReplayOptions
from space_robot.flight.replay.run import replay
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.samples import ACTUATOR_FIELDS, ORBIT_FIELDS, STATE_FIELDS

pytest.importorskip("rclpy")

COLUMNS = (
    *(*STATE_FIELDS, *ACTUATOR_FIELDS, *ORBIT_FIELDS),
    *("commanded_torque", "actuator_commands"),
)
MESSAGE_FAULTS = ("drop_state@0.05-0.1:0.2", "delay_command@0.15-0.2:2", "nan_state@0.25-0.3:0.3")
PART_FAULTS = ("wheel_fail@0.2:2", "thruster_stuck_on@0.1-0.2:thruster_1")
EVENTS = ["capture@0.15:tumbling_satellite", "release@0.3:0.05"]
FLIGHTS: dict[str, tuple[dict[str, Any], tuple[str, ...]]] = {
    "wheels": ({"actuators": "wheels", "events": EVENTS}, ()),
    "thrusters": ({"actuators": "thrusters", "controller": "ctc"}, ("--composed",)),
    "both": ({"actuators": "wheels_and_thrusters", "sensors": "fine"}, ("--composed",)),
    "torquers": ({"actuators": "wheels_and_torquers", "orbit": "iss"}, ()),
    "faults": (
        {
            "actuators": "wheels_and_thrusters",
            "seed": 2,
            "events": EVENTS[:1],
            "faults": [*PART_FAULTS, *MESSAGE_FAULTS],
        },
        ("--composed",),
    ),
}


@pytest.fixture(params=FLIGHTS)
def flown(request: pytest.FixtureRequest, fly: Callable[..., Flown]) -> tuple[Flown, FlightPlan]:
    options, more = FLIGHTS[request.param]
    words = ["--duration", "0.4", *more]
    for name, value in options.items():
        if name in ("faults", "events"):
            words += [word for text in value for word in (f"--{name[:-1]}", text)]
        else:
            words += [f"--{name}", str(value)]
    return fly(*words), FlightPlan.model_validate({"duration": 0.4, **options})


def test_actuators_fly_in_the_graph_as_in_one_process(flown: tuple[Flown, FlightPlan]) -> None:
    log, expected = read_flight(flown[0].bag), simulate(Flight(resolve(flown[1])))
    for one, other in ((log, expected), (log.as_measured(), expected.as_measured())):
        for column in COLUMNS:
            np.testing.assert_array_equal(getattr(one, column), getattr(other, column), column)
    assert not any(log.lost.values())
    assert log.actuator_commands.any()
    assert log.thrusts.any() == (flown[1].actuators == "thrusters" or bool(flown[1].faults))
    assert log.flight == expected.flight


def test_a_flight_with_actuators_is_replayed_to_the_bit(
    flown: tuple[Flown, FlightPlan], domain: int
) -> None:
    """The controller has all of its actuators' numbers from the bag."""
    names = Flight(resolve(flown[1])).plant.names
    done = replay(ReplayOptions(flown[0].bag, domain=domain))
    report = done.report()
    assert done.has_passed, report["first_difference"]
    assert report["equal"] == report["compared"] > 0
    assert set(report["axes"]) == {*names.axes, *names.actuators}
    assert not any(axis["difference_max"] for axis in report["axes"].values())
    units = {"thruster": "N", "torquer": "A m2"}
    for name, axis in report["axes"].items():
        assert axis["unit"] == units.get(name.partition("_")[0], "N m"), name
