"""Pause, step and reset of the plant's node."""

from __future__ import annotations

from enum import Enum

from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.service_calls import until

from .loop import PlantLoop
from .settings import PlantNodeSettings


class SimulationState(Enum):
    """States of a simulation, as simulation_interfaces has them."""

    STOPPED = "stopped"
    """Reset and held at tick 0, or not active at all."""
    PLAYING = "playing"
    PAUSED = "paused"


class Simulation:
    """Control of a node's plant: pause, step and reset, in any lifecycle state."""

    def __init__(self, node: ManagedNode[PlantNodeSettings]) -> None:
        self._node = node
        self._is_resetting = False
        self._is_stopped = False
        """True after a reset that stops, until the next request."""

    @property
    def state(self) -> SimulationState:
        """The present state."""
        if not self._is_running or self._is_stopped:
            return SimulationState.STOPPED
        return SimulationState.PAUSED if self._loop.control.is_paused else SimulationState.PLAYING

    def pause(self) -> str:
        """Hold the plant at the present tick; return what to say of it.

        Raises:
            InputError: the plant is not active.
        """
        is_news = self._loop.control.pause()
        return self._told(f"{'' if is_news else 'already '}paused at {self._now}")

    def resume(self) -> str:
        """Let the plant run on; return what to say of it.

        Raises:
            InputError: the plant is not active.
        """
        is_news = self._loop.control.resume()
        return self._told(f"{'goes on' if is_news else 'runs already'} at {self._now}")

    async def step(self, ticks: int) -> str:
        """Go so many ticks on, and return what to say of it once the plant is held again.

        Raises:
            InputError: the simulation is stopped or not paused, or ``ticks`` is less than 1.
            FlightError: something else has ended the step.
        """
        loop = self._loop
        if self._is_stopped:
            raise InputError("the simulation is stopped: pause it before it is stepped")
        target = loop.control.step(ticks)
        await until(lambda: loop.control.is_held or self._node.loop is not loop)
        reached = loop.control.tick
        if reached != target:
            raise FlightError(f"the step ended at tick {reached} of {target}")
        return f"stepped to {self._at(reached)}"

    async def reset(self, stop: bool = False) -> str:
        """Take the graph back to its start, where it stays paused if it was, or is to ``stop``.

        Raises:
            InputError: the plant is not active, or being reset.
            FlightError: a node of the graph could not be started anew.
        """
        keep = self._loop.control.is_paused or stop
        settings = self._node.settings
        assert settings is not None
        self._is_resetting = True
        try:
            await self._node.restart([name for name in settings.reset_with if name])
        finally:
            self._is_resetting = False
        if keep:
            self._loop.control.pause()
        text = self._told(f"reset, {'paused' if keep else 'goes on'} at {self._now}")
        self._is_stopped = stop
        return text

    @property
    def _is_running(self) -> bool:
        return self._node.is_active and not self._is_resetting

    @property
    def _loop(self) -> PlantLoop:
        loop = self._node.loop
        if not self._is_running or not isinstance(loop, PlantLoop):
            raise InputError("the plant is not active")
        return loop

    @property
    def _now(self) -> str:
        return self._at(self._loop.control.tick)

    def _at(self, tick: int) -> str:
        settings = self._node.settings
        assert settings is not None
        return f"tick {tick} ({tick * settings.period:.4f} s)"

    def _told(self, text: str) -> str:
        self._is_stopped = False
        self._loop.tell_paused()
        self._node.log(text)
        return text
