# ruff: noqa: RUF009 (declarations of signals are immutable)
"""Samples: states, commands and references, and the table of their signals.

Time is an integer tick everywhere; a stamp is tick times period (`Timebase`). Arrays are
float64, allocated once by the owner and overwritten in place.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from . import topics
from .compiled.records import Block, Record
from .errors import MessageError
from .signals import Each, Reporter, signal, signals_of

Array = NDArray[np.float64]

MOST_WHEELS, MOST_THRUSTERS, MOST_TORQUERS, MOST_PASSIVE = 8, 24, 6, 24
"""The base has no more reaction wheels, thrusters and magnetic torquers, a robot no more passive
joints. Records have room for as many, so that their number is no part of the layout, and another
number compiles nothing anew."""
MOST_ACTUATORS = MOST_WHEELS + MOST_THRUSTERS + MOST_TORQUERS
"""The base has no more of all that a command has a number for."""


class RobotNames(NamedTuple):
    """Names of a robot's numbers in messages."""

    joints: tuple[str, ...]
    """Those with motors."""
    wheels: tuple[str, ...] = ()
    thrusters: tuple[str, ...] = ()
    passive: tuple[str, ...] = ()
    """The joints without motors."""
    geared: tuple[str, ...] = ()
    """Those of `joints` with a gear, whose motors move apart from them."""
    in_orbit: bool = False
    """True for a robot in an orbit, whose state includes it."""
    torquers: tuple[str, ...] = ()
    """Magnetic torquers of the base."""

    @property
    def axes(self) -> tuple[str, ...]:
        """Those of the controlled axes: base x, y, z, then joints."""
        return (*topics.BASE_AXES, *self.joints)

    @property
    def all_joints(self) -> tuple[str, ...]:
        """Those of all joints: with motors, then without."""
        return (*self.joints, *self.passive)

    @property
    def all_axes(self) -> tuple[str, ...]:
        """Those of the controlled axes, then of the joints without motors."""
        return (*self.axes, *self.passive)

    @property
    def body(self) -> tuple[str, ...]:
        """That of the base in messages of bodies."""
        return (topics.BASE_JOINT,)

    @property
    def actuators(self) -> tuple[str, ...]:
        """Those of the base's actuators: wheels, then thrusters, then magnetic torquers."""
        return (*self.wheels, *self.thrusters, *self.torquers)

    @property
    def commanded(self) -> tuple[str, ...]:
        """Those of all that a `Command` has a number for."""
        return (*self.axes, *self.actuators)


class Timebase(NamedTuple):
    """Conversion of ticks and stamps, in integers."""

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


JOINTS = Each("joints", lambda n: n)
AXES = Each("axes", lambda n: n + 3)
WHEELS = Each("wheels", lambda n: MOST_WHEELS)
THRUSTERS = Each("thrusters", lambda n: MOST_THRUSTERS)
PASSIVE = Each("passive", lambda n: MOST_PASSIVE)
GEARED = Each("geared", lambda n: n)
ACTUATORS = Each("actuators", lambda n: MOST_ACTUATORS)
INERTIAL, BASE = "inertial axes", "base axes"
SOURCES = ("gravity_gradient", "drag", "sunlight", "magnetic")
"""Sources of the external torques of a state; magnetic is the torque of the base's residual dipole,
not of magnetic torquers."""


@dataclass(eq=False, repr=False)
class MeasuredSignals:
    """Signals of base and joints. Logs may have them twice: true and as measured."""

    base_position: Array = (
        signal(Reporter.SENSORS, 3, "m", INERTIAL, "position of the base's centre of mass")
        .sent(topics.BASE_STATE, "transforms[0].translation")
        .sent(topics.TRUTH_BASE, "transforms[0].translation")
    )
    quaternion: Array = (
        signal(Reporter.SENSORS, 4, "", "from base to inertial axes", "base attitude [w, x, y, z]")
        .sent(topics.BASE_STATE, "transforms[0].rotation")
        .sent(topics.TRUTH_BASE, "transforms[0].rotation")
        .sent(topics.TRUTH_JOINTS, "positions", first=1)
    )
    base_velocity: Array = (
        signal(Reporter.SENSORS, 3, "m/s", INERTIAL, "velocity of the base's centre of mass")
        .sent(topics.BASE_STATE, "twist[0].linear")
        .sent(topics.TRUTH_BASE, "velocities[0].linear")
    )
    omega_base: Array = (
        signal(Reporter.SENSORS, 3, "rad/s", BASE, "angular velocity of the base")
        .sent(topics.BASE_STATE, "twist[0].angular")
        .sent(topics.TRUTH_BASE, "velocities[0].angular")
        .sent(topics.TRUTH_JOINTS, "velocities")
    )
    joint_positions: Array = (
        signal(Reporter.SENSORS, JOINTS, "rad", "", "positions of the joints with motors")
        .sent(topics.JOINT_STATES, "position")
        .sent(topics.TRUTH_JOINTS, "positions")
    )
    joint_velocities: Array = (
        signal(Reporter.SENSORS, JOINTS, "rad/s", "", "velocities of the joints with motors")
        .sent(topics.JOINT_STATES, "velocity")
        .sent(topics.TRUTH_JOINTS, "velocities")
    )
    applied_torque: Array = (
        signal(
            Reporter.ECHO, AXES, "N m", BASE, "torque applied over the last tick, base and joints"
        )
        .sent(topics.JOINT_STATES, "effort", first=3)
        .sent(topics.BASE_STATE, "wrench[0].torque", length=3)
        .sent(topics.TRUTH_JOINTS, "effort")
    )
    passive_positions: Array = (
        signal(Reporter.PASSIVE, PASSIVE, "rad", "", "positions of the joints without motors")
        .sent(topics.JOINT_STATES, "position")
        .sent(topics.TRUTH_JOINTS, "positions")
    )
    passive_velocities: Array = (
        signal(Reporter.PASSIVE, PASSIVE, "rad/s", "", "velocities of the joints without motors")
        .sent(topics.JOINT_STATES, "velocity")
        .sent(topics.TRUTH_JOINTS, "velocities")
    )


@dataclass(eq=False, repr=False)
class StateSignals(MeasuredSignals):
    """All signals of a state; those that follow are only of robots that have such a part.

    A new one is a line here and the kernel that computes it; its topic is one in `topics`.
    """

    wheel_velocities: Array = signal(
        Reporter.ACTUATORS, WHEELS, "rad/s", "", "speeds of the wheels relative to the base"
    ).sent(topics.WHEELS_STATE, "velocity")
    wheel_torques: Array = signal(
        Reporter.ACTUATORS, WHEELS, "N m", "", "torques of the wheels' motors over the last tick"
    ).sent(topics.WHEELS_STATE, "effort")
    thrusts: Array = signal(
        Reporter.ACTUATORS, THRUSTERS, "N", "", "mean forces of the thrusters over the last tick"
    ).sent(topics.THRUSTERS_STATE, "effort")
    motor_positions: Array = signal(
        Reporter.ACTUATORS, GEARED, "rad", "", "positions of motors, seen through their gears"
    ).sent(topics.MOTORS_STATE, "position")
    motor_velocities: Array = signal(
        Reporter.ACTUATORS, GEARED, "rad/s", "", "velocities of motors, seen through their gears"
    ).sent(topics.MOTORS_STATE, "velocity")
    orbit_position: Array = (
        signal(Reporter.ORBIT, 3, "m", INERTIAL, "position of the origin from the Earth's centre")
        .named("position")
        .sent(topics.TRUTH_ORBIT, "positions")
    )
    orbit_velocity: Array = (
        signal(Reporter.ORBIT, 3, "m/s", INERTIAL, "velocity of the origin from the Earth's centre")
        .named("velocity")
        .sent(topics.TRUTH_ORBIT, "positions")
    )
    magnetic_field: Array = (
        signal(Reporter.ORBIT, 3, "T", BASE, "magnetic field of the Earth")
        .named("magnetic_field")
        .sent(topics.TRUTH_ORBIT, "positions")
        .sent(topics.MAGNETOMETER, "magnetic_field")
    )
    # The torque of gravity is computed every 20 ticks.
    external_torques: Array = (
        signal(Reporter.ORBIT, 12, "N m", INERTIAL, "torques by source about the centre of mass")
        .named(*(f"{source}_torque" for source in SOURCES))
        .sent(topics.TRUTH_ORBIT, "positions")
    )


class State(StateSignals, Record):
    """The signals of a `RobotState`, in one block for compiled code."""


class CommandSignals:
    """The signals of a `Command`."""

    commanded_torque: Array = signal(
        Reporter.OTHERS, AXES, "N m", BASE, "torque to apply from this tick on, base and joints"
    ).sent(topics.COMMAND, "effort")
    actuator_commands: Array = signal(
        Reporter.OTHERS, ACTUATORS, "", "", "wheel torques, N m, thrusts, N, then dipoles, A m2"
    ).sent(topics.COMMAND, "effort")


class TelemetrySignals:
    """Telemetry of a control law."""

    s: Array = signal(Reporter.OTHERS, AXES, "rad/s", "", "sliding variable").sent(
        topics.SIGNALS, "velocity"
    )
    u: Array = signal(Reporter.OTHERS, AXES, "rad/s2", "", "pseudo-acceleration")
    n_hat: Array = signal(Reporter.OTHERS, AXES, "N m", "", "time-delay estimate").sent(
        topics.SIGNALS, "effort"
    )
    e: Array = signal(Reporter.OTHERS, AXES, "rad", "", "error").sent(topics.SIGNALS, "position")


SIGNALS = signals_of(State)
ALL_FIELDS = tuple(SIGNALS)
"""Names of all signals of a state, in their order in memory."""
SENSED_FIELDS, PASSIVE_FIELDS, ACTUATOR_FIELDS, ORBIT_FIELDS = (
    tuple(name for name, declared in SIGNALS.items() if declared.reporter is reporter)
    for reporter in (Reporter.SENSORS, Reporter.PASSIVE, Reporter.ACTUATORS, Reporter.ORBIT)
)
"""Names of the signals of some reporters."""
STATE_FIELDS = (*SENSED_FIELDS, "applied_torque")
"""Names of those that a flight cannot be without."""


class RobotState(StateSignals):
    """Measurements at a tick, and what the plant applied over the interval that ended with it.

    Each signal of `StateSignals` is an attribute, a view of ``block``, which compiled code reads
    whole.
    """

    def __init__(self, tick: int, block: Block) -> None:
        """``block``: (1,) array of a `State`."""
        self.tick, self.block = tick, block
        self.numbers: Array = block.view(np.float64)
        """All signals one behind the other, the same memory."""
        for name in ALL_FIELDS:
            setattr(self, name, block[name][0])  # faster than block[0][name], see `Record.view`

    @classmethod
    def allocate(cls, n: int) -> RobotState:
        """Return a state for ``n`` joints, at rest at the origin."""
        state = cls(0, State.block(n))
        state.quaternion[0] = 1.0
        return state

    def copy(self) -> RobotState:
        """Return the same state in memory of its own."""
        return RobotState(self.tick, self.block.copy())

    def __reduce__(self) -> tuple[Any, ...]:
        """Copy and pickle tick and block; the fields of the copy are views of its own block."""
        return RobotState, (self.tick, self.block.copy())


class Reference(Record):
    """The desired motion at a tick, laid out as the two parts of a `ReferenceChunk`'s row."""

    joint_positions: Array = signal(
        Reporter.OTHERS, JOINTS, "rad", "", "desired positions of the joints with motors"
    ).sent(topics.REFERENCE_JOINTS, "positions", column="reference_joints")
    joint_velocities: Array = signal(
        Reporter.OTHERS, JOINTS, "rad/s", "", "desired velocities"
    ).sent(topics.REFERENCE_JOINTS, "velocities", column="reference_joints")
    joint_accelerations: Array = signal(
        Reporter.OTHERS, JOINTS, "rad/s2", "", "desired accelerations"
    ).sent(topics.REFERENCE_JOINTS, "accelerations", column="reference_joints")
    quaternion: Array = signal(
        Reporter.OTHERS, 4, "", "from base to inertial axes", "attitude [w, x, y, z]"
    ).sent(topics.REFERENCE_BASE, "transforms[0].rotation", column="reference_base")
    omega_base: Array = signal(
        Reporter.OTHERS, 3, "rad/s", BASE, "desired angular velocity of the base"
    ).sent(topics.REFERENCE_BASE, "velocities[0].angular", column="reference_base")
    alpha_base: Array = signal(
        Reporter.OTHERS, 3, "rad/s2", BASE, "desired angular acceleration of the base"
    ).sent(topics.REFERENCE_BASE, "accelerations[0].angular", column="reference_base")

    @staticmethod
    def parts(references: Block) -> tuple[Array, Array]:
        """Return views (k, 3, n) and (k, 10) of the joints' and the base's part of k references."""
        k, size = len(references), references.itemsize // 8
        numbers = references.view(np.float64).reshape(k, size)
        return numbers[:, :-10].reshape(k, 3, (size - 10) // 3), numbers[:, -10:]

    @classmethod
    def at_rest(cls, n: int) -> Block:
        """Return a block of one reference, at rest at zero."""
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
    """Return the laws by rising tick; of several at one tick the last, which answered it."""
    last_of_tick = {law.tick: law for law in laws}
    return tuple(law for _, law in sorted(last_of_tick.items()))
