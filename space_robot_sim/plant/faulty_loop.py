"""The plant node's loop with injected faults of the messages to and from the controller."""

from __future__ import annotations

from collections.abc import Iterator

from space_robot_msgs_py.ros.health import Health
from space_robot_msgs_py.ros.managed_node import ManagedNode

from ..faults.link import awaited_stamp
from .faults import MessageFaults
from .loop import NONE, PlantLoop, SentState
from .settings import PlantNodeSettings


class FaultyPlantLoop(PlantLoop):
    """Knows which of its messages do not arrive as they should, so a flight in lockstep repeats.

    A state that is lost, late or wrongly stamped has no answer to wait for.
    """

    def __init__(self, node: ManagedNode[PlantNodeSettings], settings: PlantNodeSettings) -> None:
        """See `PlantLoop`; ``settings.faults`` says what fails."""
        super().__init__(node, settings)
        robot = self._plant.robot
        self._faults = MessageFaults(settings.schedule(robot, settings.period), robot.n)
        self._asked = NONE
        """Tick of the newest state that a controller can have answered."""

    def health(self) -> Health:
        """Say that what is wrong is meant to be."""
        health = super().health()
        return Health(health.mode, health.level, {**health.values, "faults": "injected"})

    def _measure(self) -> Iterator[SentState]:
        tick, faults = self._plant.tick, self._faults
        measured = faults.measure(self._plant.state)
        messages = self._states.encode(measured)
        for arriving in faults.states.push(tick, messages, measured.tick):
            stamp = awaited_stamp([arriving], tick, self._asked)
            if stamp is not None:
                self._asked = stamp
            joints, base = arriving.item
            yield SentState(joints, base, NONE if stamp is None else stamp)

    def _end_tick(self) -> None:
        guard, plant, faults = self._guard, self._plant, self._faults
        for command in faults.commands.arrivals(plant.tick):
            guard.offered.tick, guard.offered.torque[:] = command.stamp, command.item
            guard.accept(plant.tick)
        super()._end_tick()

    def _deliver(self) -> None:
        faults, offered, tick = self._faults, self._guard.offered, self._plant.tick
        faults.corruption.spoil_command(offered, tick)
        faults.commands.send(tick, offered.torque.copy(), offered.tick)
