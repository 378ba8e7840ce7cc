"""The services of simulation_interfaces, against its definitions: the package is on no index.

The constants are those of version 2.1's .msg and .srv files.
"""

from __future__ import annotations

import asyncio
from collections.abc import Coroutine
from types import SimpleNamespace as Record
from typing import Any, cast

import pytest

pytest.importorskip("rclpy")

from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.run_control import RunControl
from space_robot_sim.plant.simulation import Simulation, State
from space_robot_sim.plant.standard_services import FEATURES, StandardServices

MSG = Record(
    SimulationState=Record(STATE_STOPPED=0, STATE_PLAYING=1, STATE_PAUSED=2),
    Result=Record(RESULT_FEATURE_UNSUPPORTED=0, RESULT_OK=1, RESULT_OPERATION_FAILED=4),
    SimulatorFeatures=Record(
        SIMULATION_RESET=20, SIMULATION_RESET_TIME=21, SIMULATION_RESET_STATE=22,
        SIMULATION_STATE_GETTING=24, SIMULATION_STATE_SETTING=25, SIMULATION_STATE_PAUSE=26,
        STEP_SIMULATION_SINGLE=31, STEP_SIMULATION_MULTIPLE=32,
    ),
)  # fmt: skip
SRV = Record(
    SetSimulationState=Record(
        Response=Record(ALREADY_IN_TARGET_STATE=101, STATE_TRANSITION_ERROR=102)
    ),
    ResetSimulation=Record(Request=Record(SCOPE_DEFAULT=0, SCOPE_TIME=1, SCOPE_STATE=2)),
)
QUITTING, SCOPE_ALL = 3, 255


class Held:
    """A simulation without a graph: what it is told acts on a `RunControl` at once."""

    def __init__(self) -> None:
        self.control, self.resets = RunControl(), 0

    @property
    def state(self) -> State:
        return State.PAUSED if self.control.is_paused else State.PLAYING

    def pause(self) -> None:
        self.control.pause()

    def resume(self) -> None:
        self.control.resume()

    async def step(self, ticks: int) -> None:
        self.control.begin(self.control.step(ticks))

    async def reset(self, stop: bool = False) -> None:
        if stop and not self.control.is_paused:
            raise InputError("the plant is not active")
        self.resets += 1


class Caller:
    """Calls the services as a node would, with the package's fields."""

    def __init__(self) -> None:
        self.simulation = Held()
        self.services = StandardServices(cast(Simulation, self.simulation), MSG, SRV)

    @staticmethod
    def _response() -> Record:
        return Record(
            result=Record(result=None, error_message=None), state=Record(state=None),
            features=Record(features=[], custom_info=""),
        )  # fmt: skip

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

    @staticmethod
    def _answer(call: Coroutine[Any, Any, Any]) -> tuple[int, str]:
        result = asyncio.run(call).result
        return result.result, result.error_message


def test_its_features_are_those_it_has() -> None:
    assert Caller().features() == [20, 21, 22, 24, 25, 26, 31, 32]
    assert len(FEATURES) == 8


def test_it_is_paused_and_played() -> None:
    caller = Caller()
    assert caller.get_state() == 1
    assert caller.set_state(1) == (101, "")
    assert caller.set_state(2) == (1, "")
    assert caller.get_state() == 2
    assert caller.set_state(2) == (101, "")
    assert caller.set_state(1) == (1, "")
    assert caller.get_state() == 1


def test_only_what_is_paused_can_be_stepped() -> None:
    caller = Caller()
    code, text = caller.step(1)
    assert code == 4
    assert "only a paused simulation" in text
    caller.set_state(2)
    assert caller.step(7) == (1, "")
    assert caller.simulation.control.tick == 7
    assert caller.step(0)[0] == 4
    assert caller.simulation.control.tick == 7


def test_a_stop_is_a_reset() -> None:
    caller = Caller()
    assert caller.set_state(0) == (102, "the plant is not active")
    caller.set_state(2)
    assert caller.set_state(0) == (1, "")
    assert caller.simulation.resets == 1


def test_what_there_is_not_is_told_as_unsupported() -> None:
    caller = Caller()
    assert caller.set_state(QUITTING)[0] == 0
    for scope in (1, 2, 4):
        assert caller.reset(scope)[0] == 0
    assert caller.simulation.resets == 0


@pytest.mark.parametrize("scope", [0, 3, SCOPE_ALL])
def test_time_and_state_are_reset_together(scope: int) -> None:
    caller = Caller()
    assert caller.reset(scope) == (1, "")
    assert caller.simulation.resets == 1
