"""Flight log: a flight as arrays with one row per tick."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass, field, fields, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..compiled.records import Block
from ..samples import (
    ALL_FIELDS,
    ORBIT_FIELDS,
    PASSIVE_FIELDS,
    SIGNALS,
    STATE_FIELDS,
    LawInForce,
    MeasuredSignals,
    ReferenceChunk,
    RobotNames,
    RobotState,
    State,
    StateSignals,
    Timebase,
)
from ..signals import signals_of

Array = NDArray[np.float64]

BLOCK_TICKS = 60_000
"""Rows of a block but the last: 30 s at 2 kHz, the paper's whole mission."""
REFERENCE = ("reference_joints", "reference_base")
"""The columns the desired motion fills."""
MEASURED_APART = {
    name: field.topic
    for name in ORBIT_FIELDS
    for field in SIGNALS[name].fields
    if field.topic in topics.STATES
}
"""Topic of each signal of an orbit that a sensor measures."""
MEASURED_COLUMNS = (*STATE_FIELDS, *PASSIVE_FIELDS, *MEASURED_APART)
"""Columns that `FlightLog` and `MeasuredStates` have in common."""


def of_nan(shape: tuple[int, ...]) -> Array:
    """Return an array of NaN."""
    return np.full(shape, np.nan)


@dataclass(eq=False, repr=False)
class MeasuredStates(MeasuredSignals):
    """Measured states: columns (N, ...) of a `FlightLog` as the sensors report them."""

    magnetic_field: Array = StateSignals.magnetic_field
    """(N, 3) T, base frame; (N, 0) of a robot without magnetic torquers, which has no magnetometer.
    """

    @classmethod
    def of(cls, log: FlightLog) -> MeasuredStates:
        """Return the state columns of ``log`` themselves, not copies."""
        return cls(*(getattr(log, name) for name in MEASURED_COLUMNS))

    @classmethod
    def unknown(
        cls, log: FlightLog, new: Callable[[tuple[int, ...]], Array] = of_nan
    ) -> MeasuredStates:
        """Return columns of NaN, as many rows as ``log`` has; ``new`` as in `allocate`."""
        return cls(*(new(getattr(log, name).shape) for name in MEASURED_COLUMNS))

    @property
    def angular_velocity(self) -> Array:
        """(N, 3) rad/s, base frame; the same as ``omega_base``."""
        return self.omega_base

    @property
    def columns(self) -> dict[str, Array]:
        """All of them, by name."""
        return {name: getattr(self, name) for name in MEASURED_COLUMNS}


@dataclass(eq=False, repr=False, kw_only=True)
class FlightLog(StateSignals):
    """True and desired motion and the torque given, tick by tick from 0.

    Each signal is a column (N, ...), as wide as the robot has of it: (N, 0) of what it has not.
    If measurements differ from the true states, and both were recorded, `measured` has the
    measurements. Without it both are equal, or only the measurements are known.
    """

    timebase: Timebase
    joint_names: tuple[str, ...]
    """Names of the joints with motors."""
    reference_joints: Array
    """(N, 3, n) desired position, velocity, acceleration."""
    reference_base: Array
    """(N, 10) desired quaternion, angular velocity, acceleration (base frame)."""
    actuator_commands: Array
    """(N, W+T+M) the controller's answer to the tick: torques of the wheels' motors, N m, then
    forces of the thrusters, N, then dipoles of magnetic torquers, A m2 (NaN: none)."""
    passive_names: tuple[str, ...] = ()
    """Names of the joints without motors."""
    geared_names: tuple[str, ...] = ()
    """Names of the joints with gears."""
    flight: dict[str, Any] = field(default_factory=dict)
    """The flight as recorded: controller, case, ..."""
    lost: dict[str, int] = field(default_factory=dict)
    """Number of missing messages per topic."""
    unanswered: int = 0
    """Ticks without a command of their own (by the wall clock, or where something failed)."""
    filled: int = 0
    """Ticks without a usable state, which have the one before."""
    namespace: str = "/"
    """Of the robot's topics in the bag; what is said of topics names them as in the root one."""
    unfinished: str = ""
    """Description of the end of an unfinished bag; empty for a finished one."""
    damage: tuple[str, ...] = ()
    """Damage of the bag, one sentence each."""
    commanded_torque: Array | None = None
    """(N, n+3) N m, the controller's answer to the tick (NaN: none); None: not recorded."""
    latency_s: Array | None = None
    """(N,) s from the state's sending to its answer's, by the wall clock (NaN: none)."""
    telemetry: Array | None = None
    """(N, 4, n+3) s, u, N_hat, e of the controller; of flights in this process only."""
    laws: tuple[LawInForce, ...] = ()
    """Every change of law or gains in flight, the first law first; empty: not recorded."""
    first_tick: int = 0
    """Tick of row 0; not 0 in a part of a flight."""
    measured: MeasuredStates | None = None
    """Measured states and reported torque; None: see above."""
    assumed_error: Array | None = None
    """(N, n+3) e of the telemetry, the tracking error that the law computed (NaN: not at this
    tick); None without `measured`."""
    trusted: bool = True
    """True if ``flight`` is trusted: files and modules that it names may be opened.

    For a bag it is true only if the user says so.
    """
    scenario: Any = None
    """The resolved scenario of a flight in this process, which is not pickled; None: unknown."""

    def __getstate__(self) -> dict[str, Any]:
        return {**self.__dict__, "scenario": None}

    @classmethod
    def allocate(
        cls,
        ticks: int,
        names: RobotNames | tuple[str, ...],
        timebase: Timebase,
        new: Callable[[tuple[int, ...]], Array] = of_nan,
    ) -> FlightLog:
        """Return a log of NaN.

        Args:
            ticks: its rows.
            names: of all that the robot has, or of its joints with motors if it has no more.
            timebase: of its ticks.
            new: makes a column of a shape; it may be one of other numbers, to be written later.
        """
        if not isinstance(names, RobotNames):
            names = RobotNames(names)
        shapes: dict[str, tuple[int, ...]] = {
            **{name: (signal.width(names),) for name, signal in signals_of(StateSignals).items()},
            **({} if names.in_orbit else dict.fromkeys(ORBIT_FIELDS, (0,))),
            "reference_joints": (3, len(names.joints)),
            "reference_base": (10,),
            "actuator_commands": (len(names.actuators),),
        }
        columns: dict[str, Any] = {name: new((ticks, *shape)) for name, shape in shapes.items()}
        return cls(
            timebase=timebase,
            joint_names=names.joints,
            passive_names=names.passive,
            geared_names=names.geared,
            **columns,
        )

    @property
    def ticks(self) -> int:
        """Number of rows."""
        return len(self.quaternion)

    @property
    def time(self) -> Array:
        """(N,) s, simulated time of the rows."""
        ticks = np.arange(self.first_tick, self.first_tick + self.ticks, dtype=np.float64)
        return np.asarray(ticks * self.timebase.period)

    @property
    def angular_velocity(self) -> Array:
        """(N, 3) rad/s, base frame; the same as ``omega_base``."""
        return self.omega_base

    @property
    def description(self) -> dict[str, Any]:
        """The flight as recorded; the same as ``flight``. Empty for a bag of others."""
        return self.flight

    @property
    def defects(self) -> tuple[str, ...]:
        """Defects of the recording, one sentence each: `unfinished` and `damage`."""
        return (self.unfinished, *self.damage) if self.unfinished else self.damage

    @property
    def whole(self) -> NDArray[np.bool_]:
        """(N,) whether state and reference of a row are there and finite."""
        return self.finite(STATE_FIELDS + PASSIVE_FIELDS) & self.finite(REFERENCE)

    def finite(self, columns: Iterable[str]) -> NDArray[np.bool_]:
        """(N,) whether a row has no NaN in some of the columns."""
        return finite_rows(getattr(self, name) for name in columns)

    def longest_stretch(self) -> FlightLog:
        """Longest stretch of `whole` rows, for methods that need no gaps; views, not copies.

        In an orbit its torques are known, too.
        """
        known = self.whole & self.finite(ORBIT_FIELDS)
        edges = np.diff(np.concatenate(([False], known, [False])).astype(np.int8))
        starts, stops = np.flatnonzero(edges > 0), np.flatnonzero(edges < 0)
        if not len(starts):
            return self.rows(0, 0)
        longest = int(np.argmax(stops - starts))
        return self.rows(int(starts[longest]), int(stops[longest]))

    @property
    def all_positions(self) -> Array:
        """(N, n+p) rad or m, of all joints; those without motors are behind."""
        return _beside(self.joint_positions, self.passive_positions)

    @property
    def all_velocities(self) -> Array:
        """(N, n+p) rad/s or m/s, of all joints; those without motors are behind."""
        return _beside(self.joint_velocities, self.passive_velocities)

    @property
    def prismatic(self) -> tuple[bool, ...]:
        """Of the n joints with motors and then of the p without: True for those that slide."""
        names = self.flight.get("prismatic_joints", ())
        return tuple(name in names for name in (*self.joint_names, *self.passive_names))

    @property
    def branches(self) -> tuple[int, ...]:
        """Number of actuated joints of each branch on the base; empty: one branch, or unknown."""
        recorded = self.flight.get("branches", ())
        is_list = isinstance(recorded, (list, tuple)) and all(
            type(c) is int and c > 0 for c in recorded
        )
        return tuple(recorded) if is_list and sum(recorded) == len(self.joint_names) else ()

    @property
    def axes(self) -> int:
        """Controlled coordinates, n+3."""
        return int(self.applied_torque.shape[1])

    def put(self, start: int, states: Block) -> None:
        """Copy the `State` of each tick from ``start`` on into its row."""
        _put(self, start - self.first_tick, states, ALL_FIELDS)

    def put_measured(self, start: int, states: Block) -> None:
        """Copy the measurements of each tick from ``start`` on into its row of `measured`."""
        if self.measured is not None:
            _put(self.measured, start - self.first_tick, states, MEASURED_COLUMNS)

    def put_commands(self, start: int, torques: Array) -> None:
        """Copy the commands (k, n+3+W+T+M) of each tick from ``start`` on, see `Command`."""
        assert self.commanded_torque is not None
        row = start - self.first_tick
        rows = slice(row, row + len(torques))
        self.commanded_torque[rows] = torques[:, : self.axes]
        self.actuator_commands[rows] = torques[:, self.axes :]

    def record_measured(
        self, new: Callable[[tuple[int, ...]], Array] = of_nan, names: RobotNames | None = None
    ) -> None:
        """Allocate columns of NaN for measured states and the law's error.

        ``names``: of what the robot has (None: none of the sensors `MEASURED_APART`).
        """
        self.measured = MeasuredStates.unknown(self, new)
        for name, topic in MEASURED_APART.items():
            if not (names and getattr(names, topic.of)):
                setattr(self.measured, name, np.empty((self.ticks, 0)))
        self.assumed_error = new(self.applied_torque.shape)
        self.assumed_error[:] = np.nan

    def as_measured(self) -> FlightLog:
        """The flight as the flight software knows it, with `measured` as its states."""
        if self.measured is None:
            return self
        columns: dict[str, Any] = self.measured.columns
        for name in MEASURED_APART:
            if not columns[name].size:
                del columns[name]
        return replace(self, **columns, measured=None, assumed_error=None)

    def state(self, tick: int) -> RobotState:
        """Return the state of a tick, the true one if it is known."""
        return next(self.states(tick, tick + 1))

    def states(self, start: int, stop: int) -> Iterator[RobotState]:
        """Yield the states of the ticks from ``start`` to before ``stop``, see `state`."""
        rows = slice(start - self.first_tick, stop - self.first_tick)
        block = np.zeros(stop - start, State.dtype(len(self.joint_names)))
        for name in ALL_FIELDS:
            column = getattr(self, name)[rows]
            block[name][:, : column.shape[1]] = column
        for k in range(stop - start):
            yield RobotState(start + k, block[k : k + 1])

    def references(self, start: int, stop: int) -> Block:
        """(stop - start,) array of the ticks' `Reference` each, a copy."""
        rows = slice(start - self.first_tick, stop - self.first_tick)
        chunk = ReferenceChunk(start, self.reference_joints[rows], self.reference_base[rows])
        return chunk.references()

    @property
    def columns(self) -> dict[str, Any]:
        """All arrays that have a row a tick, by name; without those of `measured`."""
        values = {f.name: getattr(self, f.name) for f in fields(self)}
        return {name: value for name, value in values.items() if isinstance(value, np.ndarray)}

    def rows(self, start: int, stop: int) -> FlightLog:
        """The rows ``start`` to ``stop``: views, not copies. Counts stay those of the whole log."""
        columns: dict[str, Any] = {name: c[start:stop] for name, c in self.columns.items()}
        if self.measured is not None:
            measured = (column[start:stop] for column in self.measured.columns.values())
            columns["measured"] = MeasuredStates(*measured)
        return replace(self, **columns, first_tick=self.first_tick + start)


def finite_rows(columns: Iterable[Array]) -> NDArray[np.bool_]:
    """(N,) true where some columns (N, ...), at least one, have no NaN."""
    each = (np.isfinite(column.reshape(len(column), -1)).all(axis=1) for column in columns)
    finite_rows: NDArray[np.bool_] = np.logical_and.reduce(list(each))
    return finite_rows


def _beside(joints: Array, passive: Array) -> Array:
    return np.hstack([joints, passive]) if passive.shape[1] else joints


def _put(
    columns: FlightLog | MeasuredStates, row: int, states: Block, names: tuple[str, ...]
) -> None:
    for name in names:
        column = getattr(columns, name)
        column[row : row + len(states)] = states[name][:, : column.shape[1]]


def block_bounds(ticks: int) -> Iterator[tuple[int, int]]:
    """Yield the first row and the row after the last of each block of a flight of ``ticks``."""
    for start in range(0, ticks, BLOCK_TICKS):
        yield start, min(start + BLOCK_TICKS, ticks)
