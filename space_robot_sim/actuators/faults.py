"""Weak actuators and stuck joints: changes of the plant itself, taken back when their time ends."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..faults.schedule import Schedule, ScheduledFault

Array = NDArray[np.float64]


class ActuatorFaults:
    """Lowers torque limits and raises Coulomb friction of one plant."""

    def __init__(self, schedule: Schedule) -> None:
        self._faults = schedule.of("saturate_base", "saturate_joints", "stuck_joint")
        self._acting: list[ScheduledFault] = []

    def apply(self, tick: int, limit: Array, coulomb: Array) -> None:
        """Make the actuators fail as they should from ``tick`` to the next.

        Args:
            tick: the tick that is about to be stepped.
            limit: (n+3,) largest torque of each axis, N m; changed in place.
            coulomb: (n,) Coulomb friction of each joint, N m; changed in place.
        """
        acting = [fault for fault in self._faults if fault.acts_at(tick)]
        if acting == self._acting:
            return
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
