"""The services of simulation_interfaces, against its definitions: the package is on no index.

The constants are those of version 2.1's .msg and .srv files.
"""

from __future__ import annotations

from collections.abc import Coroutine
from types import SimpleNamespace as Record
from typing import TYPE_CHECKING, Any, cast

import pytest

pytest.importorskip("rclpy")

from space_robot_sim.plant.loop import PlantLoop
from space_robot_sim.plant.run_control import RunControl
from space_robot_sim.plant.simulation import Simulation
from space_robot_sim.plant.simulation_services import StandardServices

if TYPE_CHECKING:
    from space_robot_msgs_py.ros.managed_node import ManagedNode
    from space_robot_sim.plant.settings import PlantNodeSettings

MSG = Record(
    SimulationState=Record(STATE_STOPPED=0, STATE_PLAYING=1, STATE_PAUSED=2),
    Result=Record(RESULT_FEATURE_UNSUPPORTED=0, RESULT_OK=1, RESULT_OPERATION_FAILED=4),
    SimulatorFeatures=Record(
        SIMULATION_RESET=20,
        SIMULATION_RESET_TIME=21,
        SIMULATION_RESET_STATE=22,
        SIMULATION_STATE_GETTING=24,
        SIMULATION_STATE_SETTING=25,
        SIMULATION_STATE_PAUSE=26,
        STEP_SIMULATION_SINGLE=31,
        STEP_SIMULATION_MULTIPLE=32,
    ),
)
SRV = Record(
    SetSimulationState=Record(
        Response=Record(ALREADY_IN_TARGET_STATE=101, STATE_TRANSITION_ERROR=102)
    ),
    ResetSimulation=Record(Request=Record(SCOPE_DEFAULT=0, SCOPE_TIME=1, SCOPE_STATE=2)),
)
QUITTING, SCOPE_ALL = 3, 255


class Node:
    """A plant's node without ROS: its lifecycle, and a loop that goes on when it is told to."""

    def __init__(self) -> None:
        self.settings = Record(period=0.0005, reset_with=[""])
        self.is_active, self.starts, self.told = False, 0, [False]
        self.start()

    def start(self) -> None:
        self.loop = object.__new__(PlantLoop)
        self.loop.control = RunControl()
        self.loop.tell_paused = lambda: self.told.append(self.control.is_paused)  # type: ignore[method-assign]
        self.is_active, self.starts = True, self.starts + 1

    def stop(self) -> None:
        self.is_active = False

    def log(self, text: str) -> None:
        pass

    @property
    def control(self) -> RunControl:
        return self.loop.control

    def run(self, ticks: int) -> int:
        """Fly so many ticks, or until it is held; return the tick reached."""
        for _ in range(ticks):
            if not self.control.holds():
                self.control.begin(self.control.tick + 1)
        self.control.holds()
        return self.control.tick


class Caller:
    """Calls the services as a node would, with the package's fields."""

    def __init__(self) -> None:
        self.node = Node()
        self.simulation = Simulation(cast("ManagedNode[PlantNodeSettings]", self.node))
        self.services = StandardServices(self.simulation, MSG, SRV)

    @staticmethod
    def _response() -> Record:
        return Record(
            result=Record(result=None, error_message=None),
            state=Record(state=None),
            features=Record(features=[], custom_info=""),
        )

    def get_state(self) -> int:
        return int(self.services.get_state(Record(), self._response()).state.state)

    def features(self) -> list[int]:
        return list(self.services.get_features(Record(), self._response()).features.features)

    def set_state(self, number: int) -> tuple[int, str]:
        request = Record(state=Record(state=number))
        return self._answer(self.services.set_state(request, self._response()))

    def step(self, steps: int) -> tuple[int, str]:
        return self._answer(self.services.step(Record(steps=steps), self._response()))

    def reset(self, scope: int) -> tuple[int, str]:
        return self._answer(self.services.reset(Record(scope=scope), self._response()))

    def _answer(self, call: Coroutine[Any, Any, Any]) -> tuple[int, str]:
        while True:  # the plant goes on while a call waits for it
            try:
                call.send(None)
            except StopIteration as end:
                return end.value.result.result, end.value.result.error_message
            self.node.run(1)


STOPPED, PLAYING, PAUSED = 0, 1, 2
OK, FAILED, ALREADY = 1, 4, 101


def test_it_announces_what_it_does_and_no_more() -> None:
    """Each scope of a reset has its number; those of time and of state alone are not among them."""
    caller = Caller()
    features = caller.features()
    assert features == [20, 24, 25, 26, 31, 32]
    for feature, scope in ((21, 1), (22, 2), (23, 4)):
        assert (caller.reset(scope)[0] == OK) == (feature in features)
    assert caller.node.starts == 1


def test_it_is_paused_and_played() -> None:
    caller = Caller()
    assert caller.get_state() == PLAYING
    assert caller.set_state(PLAYING) == (ALREADY, "")
    assert caller.set_state(PAUSED) == (OK, "")
    assert caller.node.run(5) == 0
    assert caller.get_state() == PAUSED
    assert caller.set_state(PAUSED) == (ALREADY, "")
    assert caller.set_state(PLAYING) == (OK, "")
    assert caller.node.run(5) == 5
    assert caller.get_state() == PLAYING
    assert caller.node.told == [False, True, False]


@pytest.mark.parametrize("ticks", [1, 7])
def test_a_paused_simulation_is_stepped_and_paused_again(ticks: int) -> None:
    caller = Caller()
    caller.node.run(3)
    caller.set_state(PAUSED)
    assert caller.step(ticks) == (OK, "")
    assert caller.node.run(9) == 3 + ticks
    assert caller.get_state() == PAUSED
    assert caller.step(0)[0] == FAILED


def test_what_plays_or_is_stopped_cannot_be_stepped() -> None:
    caller = Caller()
    assert caller.step(1)[0] == FAILED
    assert caller.get_state() == PLAYING
    assert caller.set_state(STOPPED) == (OK, "")
    assert caller.step(1)[0] == FAILED
    assert (caller.get_state(), caller.node.run(9)) == (STOPPED, 0)
    assert caller.set_state(PAUSED) == (OK, ""), "it can be started paused"
    assert caller.step(1) == (OK, "")


@pytest.mark.parametrize("before", [PLAYING, PAUSED])
def test_a_stop_is_a_reset_that_is_held_at_tick_0(before: int) -> None:
    caller = Caller()
    caller.node.run(4)
    caller.set_state(before)
    assert caller.set_state(STOPPED) == (OK, "")
    assert (caller.node.starts, caller.node.run(9), caller.get_state()) == (2, 0, STOPPED)
    assert caller.set_state(STOPPED) == (ALREADY, "")
    assert caller.set_state(PLAYING) == (OK, "")
    assert (caller.node.run(9), caller.get_state()) == (9, PLAYING)


@pytest.mark.parametrize("scope", [0, 3, SCOPE_ALL])
@pytest.mark.parametrize("before", [PLAYING, PAUSED])
def test_a_reset_goes_on_as_before_and_is_no_stop(scope: int, before: int) -> None:
    """What was paused is paused at tick 0, so that it can be stepped; what played plays."""
    caller = Caller()
    caller.node.run(4)
    caller.set_state(before)
    assert caller.reset(scope) == (OK, "")
    assert (caller.node.starts, caller.get_state()) == (2, before)
    assert caller.node.told[-1] is (before == PAUSED), "the other nodes are told"
    assert caller.node.run(3) == (0 if before == PAUSED else 3)
    assert caller.step(2)[0] == (OK if before == PAUSED else FAILED)


def test_a_reset_after_a_stop_leaves_it_paused() -> None:
    caller = Caller()
    caller.set_state(STOPPED)
    assert caller.reset(0) == (OK, "")
    assert caller.get_state() == PAUSED


def test_a_plant_that_is_not_active_is_stopped_and_can_do_nothing() -> None:
    caller = Caller()
    caller.node.stop()
    assert caller.get_state() == STOPPED
    assert caller.set_state(PLAYING) == (102, "the plant is not active")
    assert caller.step(1) == (FAILED, "the plant is not active")
    assert caller.reset(0) == (FAILED, "the plant is not active")


def test_a_step_that_a_reset_cuts_short_has_failed() -> None:
    caller = Caller()
    caller.set_state(PAUSED)
    call = caller.services.step(Record(steps=5), caller._response())
    call.send(None)
    caller.node.run(2)
    assert caller.reset(0) == (OK, "")
    with pytest.raises(StopIteration) as end:
        call.send(None)
    assert end.value.value.result.result == FAILED


def test_other_states_are_unsupported() -> None:
    assert Caller().set_state(QUITTING)[0] == 0
