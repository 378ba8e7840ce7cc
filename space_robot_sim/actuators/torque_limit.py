"""Torque limits of the actuators."""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import where
from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.config.validation import StrictModel

from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange

Array = NDArray[np.float64]
Limit = Annotated[float, Field(ge=0.0, le=1e9)]


class TorqueLimitSettings(StrictModel):
    """Settings of the torque limits."""

    base_torque_limit: Limit = Field(
        0.0, description="largest torque on each axis of an ideal base, N m (0: no limit)"
    )
    joint_torque_limit: Limit = Field(
        0.0, description="largest torque on each joint, N m or N (0: no limit)"
    )


class TorqueLimit(Record):
    """The torque limits of one robot's actuators."""

    limit: Array = shaped(lambda n: (n + 3,))
    """Largest torque of each axis, N m: base x, y, z (base frame), then joints."""

    @classmethod
    def build(cls, n: int, settings: TorqueLimitSettings) -> TorqueLimit:
        """Give each of ``n`` joints, and each base axis, the same limit."""
        limits = cls.allocate(n)
        limits.limit[:] = settings.joint_torque_limit or np.inf
        limits.limit[:3] = settings.base_torque_limit or np.inf
        return limits


@kernel
def limit_torque(limits: TorqueLimit, torque: Array) -> float:
    """Limit ``torque`` (n+3,) N m in place.

    Returns:
        1 if it exceeded one, else 0.
    """
    limit, saturated = limits.limit, 0.0
    for i in range(torque.size):
        wanted = torque[i]
        torque[i] = min(max(wanted, -limit[i]), limit[i])
        saturated = where(torque[i] != wanted, 1.0, saturated)
    return saturated


_TORQUE = Argument("TORQUE", "N m", 0.0, 1e6)
SATURATE_BASE = Kind("saturate_base", _TORQUE, None, "torque limit of an ideal base")
SATURATE_JOINTS = Kind("saturate_joints", _TORQUE, None, "torque limit of the joints' motors")


class WeakActuators:
    """Fault: torque limits are lower for a while."""

    KINDS: ClassVar[tuple[Kind, ...]] = (SATURATE_BASE, SATURATE_JOINTS)

    def __init__(self, schedule: Schedule) -> None:
        self._change = TemporaryChange(schedule.of(*self.KINDS))

    def apply(self, tick: int, part: TorqueLimit) -> None:
        """Apply the faults of the limits from ``tick`` to the next."""
        self._change.apply(tick, part.limit, _weaken)


def _weaken(limit: Array, fault: ScheduledFault) -> None:
    axes = limit[:3] if fault.kind == SATURATE_BASE else limit[3:]
    np.minimum(axes, fault.value, out=axes)
