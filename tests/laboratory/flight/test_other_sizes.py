"""A robot of another number of joints compiles nothing: kernels take records of any n."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from typing import Any

import pytest
from numba.core import event

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py.samples import Reference, RobotState
from space_robot_msgs_py.wire.codecs import CommandCodec, StateCodec


class Compiled(event.Listener):  # type: ignore[misc]
    """Collects the names of functions that are compiled, not those loaded from disk."""

    def __init__(self) -> None:
        self.names: list[str] = []

    def on_start(self, event: Any) -> None:
        self.names.append(event.data["dispatcher"].py_func.__qualname__)

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def compiled_functions() -> Iterator[list[str]]:
    listener = Compiled()
    with event.install_listener("numba:compile", listener):
        yield listener.names


SWAPS = [f"{0.001 * k:g}:{law}" for k, law in enumerate(laws(), 1)]


def fly(robot: str, **options: Any) -> None:
    """Fly a few ticks in one loop, and one step by step as the nodes do."""
    flight = Flight(resolve(FlightPlan(robot=robot, mission=robot, **options)))
    simulate(flight)
    names, n = flight.controller.names, flight.robot.n
    states = StateCodec(names, flight.timebase)
    commands = CommandCodec(names.commanded, flight.timebase)
    state = RobotState.allocate(n)
    for topic, data in zip(states.topics, states.encode(state), strict=True):
        states.decode(topic, data, state)
    command = flight.build_controller(flight.law).update(state, Reference.at_rest(n))
    commands.decode(commands.encode(command), command)
    Flight(resolve(flight.scenario.options)).plant.step(command)


@pytest.mark.parametrize(
    "options",
    [
        {"swaps": SWAPS, "duration": 0.001 * (len(SWAPS) + 1)},
        {"sensors": "fine", "navigation": "filtered", "duration": 0.002},
        {"actuators": "none", "duration": 0.002},
    ],
    ids=["laws", "filter", "free_base"],
)
def test_another_number_of_joints_compiles_nothing(options: dict[str, Any]) -> None:
    fly("paper", **options)
    with compiled_functions() as names:
        fly("seven_joint", **options)
    assert not names


def test_a_law_s_kernel_is_one_for_all_numbers_of_joints() -> None:
    flights = [Flight(resolve(FlightPlan(robot=robot))) for robot in ("paper", "seven_joint")]
    one, other = (flight.law.function() for flight in flights)  # type: ignore[attr-defined]
    assert one is other
