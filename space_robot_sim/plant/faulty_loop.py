"""The plant node's loop with injected faults on sensors, actuators and both links."""

from __future__ import annotations

from space_robot_msgs_py.ros.health import Health
from space_robot_msgs_py.ros.node_host import NodeHost

from ..faults.link import awaited_stamp
from .faults import PlantFaults
from .loop import PlantLoop
from .settings import PlantNodeSettings


class FaultyPlantLoop(PlantLoop):
    """Knows which of its messages do not arrive as they should, so a flight in lockstep repeats.

    A state that is lost, late or wrongly stamped has no answer to wait for.
    """

    def __init__(self, host: NodeHost, settings: PlantNodeSettings) -> None:
        """See `PlantLoop`; ``settings.faults`` says what fails."""
        super().__init__(host, settings)
        plant = self._plant
        faults = settings.parsed_faults
        self._faults = PlantFaults(faults, settings.fault_seed, plant.robot, settings.period)
        self._asked = -1
        """Tick of the newest state that a controller can have answered."""

    def health(self) -> Health:
        """Says that what is wrong is meant to be."""
        health = super().health()
        return Health(health.mode, health.level, {**health.values, "faults": "injected"})

    def _exchange(self) -> bool:
        plant, faults = self._plant, self._faults
        measured = faults.measure(plant.state)
        messages = self._states.encode(measured)
        arriving = faults.states.push(plant.tick, messages, measured.tick)
        self._publish_clock()
        for parcel in arriving:
            self._publish(*parcel.item)
            stamp = awaited_stamp([parcel], plant.tick, self._asked)
            if stamp is not None:
                self._asked = stamp
                if not self._by_the_clock and not self._wait(stamp):
                    return False
        if self._by_the_clock:
            self._wait_by_the_clock(self._asked)
        self._deliver_due()
        return not self._host.stopping

    def _step(self) -> None:
        plant = self._plant
        self._faults.actuators.apply(plant.tick, plant.torque_limit, plant.coulomb_friction)
        super()._step()

    def _deliver(self) -> None:
        faults, offered, tick = self._faults, self._guard.offered, self._plant.tick
        faults.corruption.spoil_command(offered, tick)
        faults.commands.send(tick, offered.torque.copy(), offered.tick)

    def _deliver_due(self) -> None:
        guard, tick = self._guard, self._plant.tick
        for parcel in self._faults.commands.arrivals(tick):
            guard.offered.tick, guard.offered.torque[:] = parcel.stamp, parcel.item
            guard.accept(tick)
