"""Samples: states, commands and references, free of any wire format.

Time is an integer tick everywhere; a stamp is tick times period (`Timebase`). Arrays are
float64, allocated once by the owner and overwritten in place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .compiled.records import Block, Record, shaped
from .errors import MessageError
from .topics import BASE_AXES

Array = NDArray[np.float64]

MOST_WHEELS, MOST_THRUSTERS, MOST_TORQUERS, MOST_PASSIVE, MOST_GEARS = 8, 24, 6, 24, 64
"""The base has no more reaction wheels, thrusters and magnetic torquers, a robot no more passive
joints and gears. Records have room for as many, so that their number is no part of the layout, and
another number compiles nothing anew."""


class RobotNames(NamedTuple):
    """The names that a robot's numbers go by in messages."""

    joints: tuple[str, ...]
    """Those with motors."""
    wheels: tuple[str, ...] = ()
    thrusters: tuple[str, ...] = ()
    passive: tuple[str, ...] = ()
    """The joints without motors."""
    geared: tuple[str, ...] = ()
    """Those of `joints` with a gear, whose motors move apart from them."""
    in_orbit: bool = False
    """True for a robot with an orbit, whose state tells of it."""
    torquers: tuple[str, ...] = ()
    """Magnetic torquers of the base."""

    @classmethod
    def of(
        cls,
        joints: Sequence[str],
        actuators: Sequence[str] = (),
        wheel_count: int = 0,
        passive: Sequence[str] = (),
        geared: Sequence[str] = (),
        torquer_count: int = 0,
    ) -> RobotNames:
        """Take the joints' names and those of the base's ``actuators``.

        These are wheels, then thrusters, then magnetic torquers.
        """
        behind = len(actuators) - torquer_count
        return cls(
            tuple(joints),
            tuple(actuators[:wheel_count]),
            tuple(actuators[wheel_count:behind]),
            tuple(passive),
            tuple(geared),
            torquers=tuple(actuators[behind:]),
        )

    @property
    def axes(self) -> tuple[str, ...]:
        """Those of the controlled axes: base x, y, z, then joints."""
        return (*BASE_AXES, *self.joints)

    @property
    def all_joints(self) -> tuple[str, ...]:
        """Those of all joints: with motors, then without."""
        return (*self.joints, *self.passive)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Those of the base's actuators: wheels, then thrusters, then magnetic torquers."""
        return (*self.wheels, *self.thrusters, *self.torquers)

    @property
    def commanded(self) -> tuple[str, ...]:
        """Those of all that a `Command` has a number for."""
        return (*self.axes, *self.actuators)


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


class State(Record):
    """The numbers of a `RobotState`, in one block for compiled code."""

    base_position: Array = shaped(lambda n: (3,))
    """Position of the base's CoM in the inertial frame, m."""
    quaternion: Array = shaped(lambda n: (4,))
    """Base attitude ``[w, x, y, z]``, from the base frame to the inertial frame."""
    base_velocity: Array = shaped(lambda n: (3,))
    """Velocity of the base's CoM on inertial axes, m/s."""
    omega_base: Array = shaped(lambda n: (3,))
    """Base angular velocity in the *base* frame, as a gyro measures it, rad/s."""
    joint_positions: Array = shaped(lambda n: (n,))
    """Positions of the joints with motors: rad of those that turn, m of prismatic ones."""
    joint_velocities: Array = shaped(lambda n: (n,))
    """Their velocities, rad/s or m/s."""
    applied_torque: Array = shaped(lambda n: (n + 3,))
    """Torque applied over the last interval, N m: base x, y, z in the base frame, then joints; the
    force, N, of a prismatic one."""
    wheel_velocities: Array = shaped(lambda n: (MOST_WHEELS,))
    """Speeds of the reaction wheels about their axes relative to the base, rad/s; 0 where the base
    has no wheel."""
    wheel_torques: Array = shaped(lambda n: (MOST_WHEELS,))
    """Torques that the motors gave the wheels over the last interval, N m."""
    thrusts: Array = shaped(lambda n: (MOST_THRUSTERS,))
    """Forces of the thrusters, means over the last interval, N."""
    passive_positions: Array = shaped(lambda n: (MOST_PASSIVE,))
    """Positions of the joints without motors, rad or m; 0 where the robot has none."""
    passive_velocities: Array = shaped(lambda n: (MOST_PASSIVE,))
    """Their velocities, rad/s or m/s."""
    motor_positions: Array = shaped(lambda n: (n,))
    """Positions of the motors of joints with gears, seen through the gears, rad or m, one after the
    other; the rest is 0."""
    motor_velocities: Array = shaped(lambda n: (n,))
    """Their velocities, rad/s or m/s."""
    orbit_position: Array = shaped(lambda n: (3,))
    """Position of the inertial frame's origin from the Earth's centre, m; 0 without an orbit."""
    orbit_velocity: Array = shaped(lambda n: (3,))
    """Its velocity, m/s."""
    magnetic_field: Array = shaped(lambda n: (3,))
    """Magnetic field of the Earth on base axes, T."""
    external_torques: Array = shaped(lambda n: (12,))
    """Torques about the robot's centre of mass, inertial axes, N m, by `SOURCES`; that of gravity
    is computed every 20 ticks."""


SOURCES = ("gravity_gradient", "drag", "sunlight", "magnetic")
"""Sources of the external torques of a state; magnetic is the torque of the base's residual dipole,
not of magnetic torquers."""
ALL_FIELDS = tuple(State.__annotations__)
"""Names of all numbers of a state, in their order in memory."""
ACTUATOR_FIELDS = (
    "wheel_velocities",
    "wheel_torques",
    "thrusts",
    "motor_positions",
    "motor_velocities",
)
"""Names of those that are of the base's actuators and of joints' motors; no sensor spoils them."""
PASSIVE_FIELDS = ("passive_positions", "passive_velocities")
"""Names of those of the joints without motors; no sensor spoils and no controller reads them."""
ORBIT_FIELDS = ("orbit_position", "orbit_velocity", "magnetic_field", "external_torques")
"""Names of those that a robot in orbit has."""
STATE_FIELDS = tuple(
    n for n in ALL_FIELDS if n not in ACTUATOR_FIELDS + PASSIVE_FIELDS + ORBIT_FIELDS
)
"""Names of the others, which come first in memory."""


class RobotState:
    """What the plant measures at a tick, and what it applied over the interval just ended.

    Each field of `State` is an attribute, a view of ``block``, which compiled code reads whole.
    """

    __slots__ = ("block", "numbers", "tick", *ALL_FIELDS)
    base_position: Array
    quaternion: Array
    base_velocity: Array
    omega_base: Array
    joint_positions: Array
    joint_velocities: Array
    applied_torque: Array
    wheel_velocities: Array
    wheel_torques: Array
    thrusts: Array
    passive_positions: Array
    passive_velocities: Array
    motor_positions: Array
    motor_velocities: Array
    orbit_position: Array
    orbit_velocity: Array
    magnetic_field: Array
    external_torques: Array

    def __init__(self, tick: int, block: Block) -> None:
        """``block``: (1,) array of a `State`."""
        self.tick, self.block = tick, block
        self.numbers: Array = block.view(np.float64)
        """All fields one behind the other, the same memory."""
        for name in ALL_FIELDS:
            setattr(self, name, block[name][0])  # faster than block[0][name], see `Record.view`

    @classmethod
    def allocate(cls, n: int) -> RobotState:
        """A state for ``n`` joints, at rest at the origin."""
        state = cls(0, State.block(n))
        state.quaternion[0] = 1.0
        return state

    def copy(self) -> RobotState:
        """The same state in memory of its own."""
        return RobotState(self.tick, self.block.copy())

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle tick and block; the fields of the copy are views of its own block."""
        return RobotState, (self.tick, self.block.copy())


class Reference(Record):
    """The desired motion at a tick, laid out as the two parts of a `ReferenceChunk`'s row."""

    joint_positions: Array = shaped(lambda n: (n,))
    """rad."""
    joint_velocities: Array = shaped(lambda n: (n,))
    """rad/s."""
    joint_accelerations: Array = shaped(lambda n: (n,))
    """rad/s2."""
    quaternion: Array = shaped(lambda n: (4,))
    """Base attitude ``[w, x, y, z]``, from the base frame to the inertial frame."""
    omega_base: Array = shaped(lambda n: (3,))
    """Angular velocity of the base in the base frame, rad/s."""
    alpha_base: Array = shaped(lambda n: (3,))
    """Angular acceleration of the base in the base frame, rad/s2."""

    @staticmethod
    def parts(references: Block) -> tuple[Array, Array]:
        """Views (k, 3, n) and (k, 10) of the joints' and the base's part of k references."""
        k, size = len(references), references.itemsize // 8
        numbers = references.view(np.float64).reshape(k, size)
        return numbers[:, :-10].reshape(k, 3, (size - 10) // 3), numbers[:, -10:]

    @classmethod
    def at_rest(cls, n: int) -> Block:
        """A block of one that asks for rest at zero."""
        block = cls.block(n)
        block[0].quaternion[0] = 1.0
        return block


@dataclass(slots=True)
class Command:
    """Torque to hold from the tick it answers until the next."""

    tick: int
    torque: Array
    """(n+3+A,) N m: base x, y, z (base frame), then joints; then what is asked of each actuator of
    the base: torques of the wheels' motors, N m, forces of the thrusters, N, and dipoles of the
    magnetic torquers, A m2."""


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

    def references(self) -> Block:
        """(k,) array of a `Reference` each, a copy."""
        references: Block = np.empty(len(self.joints), Reference.dtype(self.joints.shape[2]))
        joints, base = Reference.parts(references)
        joints[:], base[:] = self.joints, self.base
        return references


class LawInForce(NamedTuple):
    """The control law, with its gains, that commands from a tick on."""

    tick: int
    """First tick that is answered with it."""
    name: str
    gains: Mapping[str, tuple[float, ...]]
    """A value an axis of each gain."""
    is_first: bool = False
    """True if the controller begins with it: a controller that was started again does so, too."""


def in_order(laws: Iterable[LawInForce]) -> tuple[LawInForce, ...]:
    """Laws by rising tick; of several of one tick the last, under which it was answered."""
    last_of_tick = {law.tick: law for law in laws}
    return tuple(law for _, law in sorted(last_of_tick.items()))
