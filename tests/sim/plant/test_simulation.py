"""Pause, step and reset: the run control, and simulation_interfaces' services.

The package is on no index: constants are those of version 2.1's .msg and .srv files.
"""

from __future__ import annotations

from collections.abc import Coroutine
from types import SimpleNamespace as Record
from typing import Any, cast

import pytest

from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.pacing import RunControl

pytest.importorskip("rclpy")

from space_robot_sim.plant.loop import PlantLoop
from space_robot_sim.plant.services import Simulation, StandardServices

FEATURES = {
    **{"SIMULATION_RESET": 20, "SIMULATION_RESET_TIME": 21, "SIMULATION_RESET_STATE": 22},
    **{"SIMULATION_STATE_GETTING": 24, "SIMULATION_STATE_SETTING": 25},
    **{"SIMULATION_STATE_PAUSE": 26, "STEP_SIMULATION_SINGLE": 31, "STEP_SIMULATION_MULTIPLE": 32},
}
MSG = Record(
    SimulationState=Record(STATE_STOPPED=0, STATE_PLAYING=1, STATE_PAUSED=2),
    Result=Record(RESULT_FEATURE_UNSUPPORTED=0, RESULT_OK=1, RESULT_OPERATION_FAILED=4),
    SimulatorFeatures=Record(**FEATURES),
)
STATES = {"ALREADY_IN_TARGET_STATE": 101, "STATE_TRANSITION_ERROR": 102}
SRV = Record(
    SetSimulationState=Record(Response=Record(**STATES)),
    ResetSimulation=Record(Request=Record(SCOPE_DEFAULT=0, SCOPE_TIME=1, SCOPE_STATE=2)),
)
STOPPED, PLAYING, PAUSED, QUITTING = 0, 1, 2, 3
UNSUPPORTED, OK, FAILED, ALREADY, WRONG = 0, 1, 4, 101, 102
SCOPE_ALL = 255


class Node:
    """A plant's node without ROS: its lifecycle, and a loop that goes on when it is told to."""

    def __init__(self) -> None:
        self.settings = Record(period=0.0005, reset_with=[""])
        self.is_active, self.starts, self.told = False, 0, [False]
        self.logged: list[str] = []
        self.start()

    def start(self) -> None:
        self.loop = object.__new__(PlantLoop)
        self.loop.control = RunControl()
        self.loop.report_pause = lambda: self.told.append(self.control.is_paused)  # type: ignore[method-assign]
        self.is_active, self.starts = True, self.starts + 1

    async def restart(self, others: list[str]) -> None:
        self.is_active = False
        self.start()

    def log(self, text: str) -> None:
        self.logged.append(text)

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
        self.services = StandardServices(Simulation(cast(Any, self.node)), MSG, SRV)
        self.said = ""

    @staticmethod
    def response() -> Record:
        return Record(result=Record(), state=Record(), features=Record())

    def run(self, ticks: int) -> int:
        return self.node.run(ticks)

    def state(self) -> int:
        return int(self.services.get_state(Record(), self.response()).state.state)

    def set(self, number: int) -> int:
        request = Record(state=Record(state=number))
        return self._answer(self.services.set_state(request, self.response()))

    def step(self, steps: int) -> int:
        return self._answer(self.services.step(Record(steps=steps), self.response()))

    def reset(self, scope: int) -> int:
        return self._answer(self.services.reset(Record(scope=scope), self.response()))

    def _answer(self, call: Coroutine[Any, Any, Any]) -> int:
        while True:  # the plant goes on while a call waits for it
            try:
                call.send(None)
            except StopIteration as end:
                self.said = end.value.result.error_message
                return int(end.value.result.result)
            self.node.run(1)


CALLS: dict[str, list[tuple[Any, ...]]] = {
    "paused and played": [
        *(("state", PLAYING), ("set", PLAYING, ALREADY), ("set", PAUSED, OK), ("run", 5, 0)),
        *(("state", PAUSED), ("set", PAUSED, ALREADY), ("set", PLAYING, OK), ("run", 5, 5)),
        *(("state", PLAYING), ("set", QUITTING, UNSUPPORTED)),
    ],
    "stepped and paused again": [
        *(("run", 3, 3), ("set", PAUSED, OK), ("step", 7, OK), ("run", 9, 10), ("state", PAUSED)),
        *(("step", 1, OK), ("run", 9, 11), ("step", 0, FAILED), ("run", 9, 11)),
    ],
    "what plays or is stopped cannot be stepped": [
        *(("step", 1, FAILED), ("state", PLAYING), ("set", STOPPED, OK), ("step", 1, FAILED)),
        *(("state", STOPPED), ("run", 9, 0), ("set", PAUSED, OK), ("step", 1, OK), ("run", 9, 1)),
    ],
    "a stop is a reset that is held at tick 0": [
        *(("run", 4, 4), ("set", STOPPED, OK), ("run", 9, 0), ("state", STOPPED)),
        *(("set", STOPPED, ALREADY), ("set", PLAYING, OK), ("run", 9, 9), ("state", PLAYING)),
        *(("set", PAUSED, OK), ("set", STOPPED, OK), ("run", 9, 0), ("state", STOPPED)),
    ],
    "a reset after a stop leaves it paused": [
        *(("set", STOPPED, OK), ("reset", 0, OK), ("state", PAUSED))
    ],
    **{
        f"a reset of scope {scope} goes on as before": [
            *(("run", 4, 4), ("reset", scope, OK), ("state", PLAYING), ("run", 3, 3)),
            *(("step", 2, FAILED), ("set", PAUSED, OK), ("reset", scope, OK), ("state", PAUSED)),
            *(("run", 3, 0), ("step", 2, OK), ("run", 9, 2)),
        ]
        for scope in (0, 3, SCOPE_ALL)
    },
}


@pytest.mark.parametrize("name", CALLS)
def test_services(name: str) -> None:
    """Each row: a call, its argument, and the answer, or the tick that is reached."""
    caller = Caller()
    for call, *given, answer in CALLS[name]:
        assert getattr(caller, call)(*given) == answer, (call, given)


def test_it_announces_what_it_does_and_tells_the_other_nodes_of_pauses() -> None:
    """Each scope of a reset has its number; those of time and of state alone are not among them."""
    caller = Caller()
    features = caller.services.get_features(Record(), caller.response()).features.features
    assert list(features) == [20, 24, 25, 26, 31, 32]
    for feature, scope in ((21, 1), (22, 2), (23, 4)):
        assert (caller.reset(scope) == OK) == (feature in features)
    assert caller.node.starts == 1
    caller.run(3)
    caller.set(PAUSED)
    caller.reset(0)
    assert caller.node.logged == [
        "paused at tick 3 (0.0015 s)",
        "reset, paused at tick 0 (0.0000 s)",
    ]
    assert caller.node.starts == 2
    assert caller.node.told[-1]
    caller.set(PLAYING)
    assert not caller.node.told[-1]


def test_a_plant_that_is_not_active_is_stopped_and_can_do_nothing() -> None:
    caller = Caller()
    caller.node.is_active = False
    assert caller.state() == STOPPED
    for call, argument, answer in (
        ("set", PLAYING, WRONG),
        ("step", 1, FAILED),
        ("reset", 0, FAILED),
    ):
        assert getattr(caller, call)(argument) == answer
        assert caller.said == "the plant is not active"


def test_a_step_that_a_reset_cuts_short_has_failed() -> None:
    caller = Caller()
    caller.set(PAUSED)
    call = caller.services.step(Record(steps=5), caller.response())
    call.send(None)
    caller.run(2)
    assert caller.reset(0) == OK
    with pytest.raises(StopIteration) as end:
        call.send(None)
    assert end.value.value.result.result == FAILED


def test_the_run_control_says_why_it_does_not_step() -> None:
    """A pause ends a step; ``pause`` and ``resume`` tell whether they changed anything."""
    control = RunControl()
    with pytest.raises(InputError, match="only a paused simulation"):
        control.step(1)
    assert control.pause()
    assert not control.is_held, "this tick's work is not done yet"
    assert control.holds()
    assert not control.pause()
    with pytest.raises(InputError, match="1 tick or more, got 0"):
        control.step(0)
    assert control.step(3) == 3
    assert not control.is_held, "at the start of a step, where it was held until now"
    control.begin(1)
    with pytest.raises(InputError, match="a step to tick 3 is under way"):
        control.step(1)
    assert control.pause()
    assert control.holds()
    assert control.resume()
    assert not control.resume()
    assert not control.holds()
