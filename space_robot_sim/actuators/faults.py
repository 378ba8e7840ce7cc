"""Weak actuators and stuck joints: changes of the plant itself, taken back when their time ends."""

from __future__ import annotations

import numpy as np

from ..faults.schedule import Schedule, ScheduledFault
from ..plant.plant import Plant, PlantMemory


class ActuatorFaults:
    """Lowers torque limits and raises Coulomb friction of one plant."""

    def __init__(self, schedule: Schedule) -> None:
        self._faults = schedule.of("saturate_base", "saturate_joints", "stuck_joint")
        self._acting: list[ScheduledFault] = []

    def apply(self, plant: Plant) -> None:
        """Make ``plant`` fail as it should over the tick it is about to step."""
        acting = [fault for fault in self._faults if fault.acts_at(plant.tick)]
        if acting == self._acting:
            return
        memory: PlantMemory = plant.block[0]
        limit, coulomb = memory.limit, memory.environment.coulomb
        if not self._acting:
            self._sound = limit.copy(), coulomb.copy()
        limit[:], coulomb[:] = self._sound
        for fault in acting:
            if fault.kind == "stuck_joint":
                joint = fault.joint - 1
                coulomb[joint] = max(coulomb[joint], fault.value)
            else:
                axes = limit[:3] if fault.kind == "saturate_base" else limit[3:]
                np.minimum(axes, fault.value, out=axes)
        self._acting = acting
