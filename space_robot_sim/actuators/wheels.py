"""Reaction wheels that turn the base; a motor can push a wheel only up to a speed.

The motor of wheel k gives the torque ``u_k`` about its axis ``a_k``, the base gets ``-a_k u_k``.
It gives no more than its largest torque, nor more than would push the wheel past its largest
momentum ``h`` within a tick of T:

    -max(0, h + J Omega) / T <= u <= max(0, h - J Omega) / T

How the wheels' rotation acts on the robot, and their friction, is the dynamics'
(`space_robot_sim.dynamics`).
"""

from __future__ import annotations

from typing import Annotated, ClassVar

import numpy as np
from numpy.typing import NDArray
from pydantic import AfterValidator, Field

from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.records import Record, assign, shaped
from space_robot_msgs_py.config.validation import StrictModel
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_WHEELS

from ..faults.axes import About
from ..faults.grammar import Argument, Kind
from ..faults.schedule import Schedule, ScheduledFault, TemporaryChange
from .mounting import (
    NO_VECTORS,
    Positive,
    Sizes,
    Vectors,
    are_directions,
    directions,
    values_of,
)

Array = NDArray[np.float64]
PER_WHEEL = "one value for all wheels, or one each"


def _axes(flat: list[float]) -> list[float]:
    return are_directions(flat, MOST_WHEELS)


class WheelSettings(StrictModel):
    """Balanced reaction wheels on the base; by default none.

    The base's inertia in the robot's file is that with its wheels locked: their rotors' included.
    """

    axes: Annotated[Vectors, AfterValidator(_axes)] = Field(
        NO_VECTORS,
        description="spin axes in the base frame: x, y, z of each wheel, one behind the other "
        "([0.0]: no wheels)",
    )
    rotor_inertia: Positive = Field(
        [0.01], description=f"of the rotor about its axis, kg m2; {PER_WHEEL}"
    )
    max_torque: Sizes = Field(
        [0.0], description=f"largest torque of the motor, N m (0: no limit); {PER_WHEEL}"
    )
    max_momentum: Sizes = Field(
        [0.0],
        description="momentum rotor_inertia times speed up to which the motor speeds a wheel up, "
        f"N m s (0: no limit); {PER_WHEEL}",
    )
    coulomb: Sizes = Field([0.0], description=f"Coulomb friction, N m; {PER_WHEEL}")
    viscous: Sizes = Field([0.0], description=f"viscous friction, N m s/rad; {PER_WHEEL}")
    initial_speed: Vectors = Field(
        [0.0], description=f"speed relative to the base at tick 0, rad/s; {PER_WHEEL}"
    )

    @property
    def count(self) -> int:
        """Number of wheels."""
        return len(directions(self.axes))

    @property
    def unit_axes(self) -> Array:
        """(W, 3) unit vectors in the base frame."""
        return directions(self.axes)

    def values(self, name: str) -> Array:
        """Return (W,) values of the setting ``name``, one a wheel.

        Raises:
            InputError: it has neither one value nor one a wheel.
        """
        return values_of(getattr(self, name), f"wheels.{name}", self.count, "wheel")

    def limits(self, name: str) -> Array:
        """Return the `values` of a limit, infinite where its 0 says that there is none."""
        values = self.values(name)
        return np.where(values > 0.0, values, np.inf)

    def spin_momenta(self, speeds: Array) -> Array:
        """Return ``J Omega`` (..., W), N m s, of speeds relative to the base (..., W), rad/s."""
        return speeds * self.values("rotor_inertia")

    def check(self, base_inertia: Array) -> None:
        """See that the numbers fit one another and a base.

        Args:
            base_inertia: (3, 3) kg m2 of the base with its wheels locked, about its CoM.

        Raises:
            InputError: they do not.
        """
        if not self.count:
            return
        found = {name: self.values(name) for name in type(self).model_fields if name != "axes"}
        inertia, axes = found["rotor_inertia"], self.unit_axes
        stored, limits = inertia * np.abs(found["initial_speed"]), found["max_momentum"]
        for i in np.flatnonzero((limits > 0.0) & (stored > limits)):
            raise InputError(
                f"wheels.initial_speed stores {stored[i]:g} N m s in wheel_{i + 1}, "
                f"max_momentum is {limits[i]:g}"
            )
        moments = np.linalg.eigvalsh(base_inertia - (axes.T * inertia) @ axes)
        if not moments[0] > 0.0:
            raise InputError(
                "wheels.rotor_inertia: the base's inertia must be larger than its rotors', without "
                f"them its smallest principal moment is {moments[0]:g} kg m2"
            )


class Wheels(Record):
    """The motors of one base's wheels; numbers beyond the last wheel are zero."""

    count: float = shaped(lambda n: ())
    axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Unit vectors in the base frame."""
    inertia: Array = shaped(lambda n: (MOST_WHEELS,))
    """J of each rotor about its axis, kg m2."""
    max_torque: Array = shaped(lambda n: (MOST_WHEELS,))
    """N m."""
    max_momentum: Array = shaped(lambda n: (MOST_WHEELS,))
    """h, N m s."""
    failed: Array = shaped(lambda n: (MOST_WHEELS,))
    """1 for a wheel whose motor is dead."""
    saturated: Array = shaped(lambda n: (MOST_WHEELS,))
    """1 for a wheel that was asked over the last tick for all that it can give, or more."""
    saturated_ticks: Array = shaped(lambda n: (MOST_WHEELS,))
    """Such ticks so far."""

    @classmethod
    def build(cls, n: int, settings: WheelSettings) -> Wheels:
        """Read settings that fit one another, see `WheelSettings.check`."""
        wheels, count = cls.allocate(n), settings.count
        assign(wheels, count=count)
        if count:
            wheels.axis[:count] = settings.unit_axes
            wheels.inertia[:count] = settings.values("rotor_inertia")
            for name in ("max_torque", "max_momentum"):
                getattr(wheels, name)[:count] = settings.limits(name)
        return wheels


@kernel
def drive_wheels(
    wheels: Wheels, asked: Array, velocities: Array, period: float, torques: Array, base: Array
) -> float:
    """Write what the motors give over a tick into ``torques``; add what the base gets of it.

    Args:
        wheels: whose saturation is counted.
        asked: (W,) or more, torque asked of each motor, N m.
        velocities: (MOST_WHEELS,) relative to the base, rad/s.
        period: of a tick, s.
        torques: (MOST_WHEELS,) N m, written.
        base: (3,) torque on the base, N m, base axes.

    Returns:
        1 if a wheel is saturated, else 0.
    """
    found = 0.0
    for k in range(int(wheels.count)):
        momentum, limit = wheels.inertia[k] * velocities[k], wheels.max_momentum[k]
        upper = min(wheels.max_torque[k], max(0.0, limit - momentum) / period)
        lower = -min(wheels.max_torque[k], max(0.0, limit + momentum) / period)
        torque = min(max(asked[k], lower), upper)
        at_limit = asked[k] >= upper if asked[k] > 0.0 else asked[k] <= lower
        saturated = 1.0 if at_limit and asked[k] != 0.0 else 0.0
        if wheels.failed[k] != 0.0:
            torque = saturated = 0.0
        wheels.saturated[k] = saturated
        wheels.saturated_ticks[k] += saturated
        found = max(found, saturated)
        torques[k] = torque
        for i in range(3):
            base[i] -= wheels.axis[k, i] * torque
    return found


WHEEL_FAIL = Kind(
    "wheel_fail", Argument("", "", 0.0, 0.0, about=About.WHEEL), None,
    "the motor of a reaction wheel is dead: the wheel runs on freely",
)  # fmt: skip


class DeadWheel:
    """Lets the motors of some wheels give nothing for a while."""

    KINDS: ClassVar[tuple[Kind, ...]] = (WHEEL_FAIL,)

    def __init__(self, schedule: Schedule) -> None:
        self._change = TemporaryChange(schedule.of(WHEEL_FAIL))

    def apply(self, tick: int, part: Wheels) -> None:
        """Let those be dead that should be from ``tick`` to the next."""
        self._change.apply(tick, part.failed, _kill)


def _kill(failed: Array, fault: ScheduledFault) -> None:
    failed[list(fault.axes)] = 1.0
