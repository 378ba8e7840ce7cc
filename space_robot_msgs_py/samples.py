"""What the nodes tell one another, free of any wire format.

Time is an integer tick everywhere; a stamp is tick times period (`Timebase`). Arrays are
float64, allocated once by the owner and overwritten in place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from .errors import MessageError

Array = NDArray[np.float64]


class Timebase(NamedTuple):
    """Ticks to stamps and back, in integers: never a clock's difference."""

    period_ns: int

    @property
    def period(self) -> float:
        """Length of a tick in seconds."""
        return self.period_ns * 1e-9

    def stamp_ns(self, tick: int) -> int:
        """Simulated time of a tick, ns."""
        return tick * self.period_ns

    def tick(self, stamp_ns: int) -> int:
        """The tick of a stamp.

        Raises:
            MessageError: the stamp is not a whole number of ticks, or before the first.
        """
        tick, rest = divmod(stamp_ns, self.period_ns)
        if rest or tick < 0:
            raise MessageError(
                f"stamp {stamp_ns} ns is not a whole number of {self.period_ns} ns ticks: "
                "do all nodes have the same period?",
                reason="stamp",
            )
        return tick


@dataclass(slots=True)
class RobotState:
    """What the plant measures at a tick, and what it applied over the interval just ended."""

    tick: int
    base_position: Array
    """(3,) m, base CoM in the inertial frame."""
    quaternion: Array
    """(4,) ``[w, x, y, z]``, base attitude."""
    base_velocity: Array
    """(3,) m/s, base CoM, inertial frame."""
    omega_base: Array
    """(3,) rad/s, base angular velocity in the *base* frame, as a gyro measures it."""
    joint_positions: Array
    """(n,) rad."""
    joint_velocities: Array
    """(n,) rad/s."""
    applied_torque: Array
    """(n+3,) N m applied over the last interval: base x, y, z (base frame), then joints."""

    @classmethod
    def allocate(cls, n: int) -> RobotState:
        """A state for ``n`` joints, at rest at the origin."""
        quaternion = np.array([1.0, 0.0, 0.0, 0.0])
        return cls(
            0, np.zeros(3), quaternion, np.zeros(3), np.zeros(3), np.zeros(n), np.zeros(n),
            np.zeros(n + 3),
        )  # fmt: skip


@dataclass(slots=True)
class Command:
    """Torque to hold from the tick it answers until the next."""

    tick: int
    torque: Array
    """(n+3,) N m: base x, y, z (base frame), then joints."""


@dataclass(slots=True)
class ReferenceChunk:
    """A stretch of the desired motion, one row a tick."""

    start: int
    """Tick of the first row."""
    joints: Array
    """(k, 3, n) position rad, velocity rad/s, acceleration rad/s2."""
    base: Array
    """(k, 10) quaternion ``[w, x, y, z]``, then angular velocity rad/s and acceleration rad/s2,
    both in the base frame."""

    @property
    def stop(self) -> int:
        """Tick after the last row."""
        return self.start + len(self.joints)


class LawInForce(NamedTuple):
    """The control law, with its gains, that commands from a tick on."""

    tick: int
    """First tick that is answered with it."""
    name: str
    gains: Mapping[str, tuple[float, ...]]
    """A value an axis of each gain."""
    is_first: bool = False
    """Whether the controller begins with it: a controller that was started again does so, too."""


def in_order(laws: Iterable[LawInForce]) -> tuple[LawInForce, ...]:
    """Laws by rising tick; of several of one tick the last, under which it was answered."""
    last_of_tick = {law.tick: law for law in laws}
    return tuple(law for _, law in sorted(last_of_tick.items()))
