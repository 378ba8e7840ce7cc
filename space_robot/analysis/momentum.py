"""Angular momentum of robot and wheels about their common centre of mass, on inertial axes.

The base's inertia in the robot's file includes its wheels, locked. So the robot's momentum is
that of everything with locked wheels, and the wheels' is what their spin relative to the base adds,
``sum a_k J_k Omega_k``. So it is with the rotors of motors behind gears. Motors and joints only
move it from one to the other: the sum changes by what comes from outside, that is thrusters,
magnetic torquers, the disturbances of (61) and of the user's own, what acts in orbit, and what a
captured or released target has, and by nothing else.
"""

from __future__ import annotations

from contextlib import suppress
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from space_robot_model.elementary.matrices import Array, norms, product, unit_rows
from space_robot_model.hardware.base_actuators import WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import motor_momentum
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.captures import CaptureEvent, Captures
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.events import Capture
from space_robot_sim.environment.impact import Impact

from .analysed_log import AnalysedLog
from .described import NotDescribedError, flown_captures, flown_events, plant_settings
from .external_torques import base_loads, body_axes, torque_about_centre
from .series import Definition, TimeSeries, metrics, series

VELOCITIES = (
    "base_velocity",
    "omega_base",
    "joint_velocities",
    "passive_velocities",
    "wheel_velocities",
    "motor_velocities",
)
"""Columns of the velocities that a capture changes, in its order."""


class Momentum(NamedTuple):
    """Angular momentum of a flight's parts, tick by tick; N m s on inertial axes."""

    robot: Array
    """(N, 3) of all bodies, wheels locked."""
    base: Array
    """(N, 3) the share of it that the base has."""
    wheels: Array
    """(N, 3) of the wheels' spin."""
    motors: Array
    """(N, 3) of the spin of rotors behind gears."""
    outside: Array
    """(N, 3) N m s that came from outside since the first row."""
    centre_of_mass: Array
    """(N, 3) m, of the robot, inertial frame."""

    @property
    def total(self) -> Array:
        """(N, 3) robot, wheels and motors; less `outside` it is conserved."""
        return self.robot + self.wheels + self.motors


class MomentumSeries:
    """Computes the momentum of a flight, whose rows are asked for in their order.

    At the tick of a capture or release it is that after it; the change is from outside.
    """

    def __init__(self, flight: AnalysedLog) -> None:
        """Begin at the first row; InputError: robot, actuators or environment are not known."""
        settings = plant_settings(flight.log)
        if settings.has_orbit and not flight.log.external_torques.shape[1]:
            raise NotDescribedError("the torques that acted in the orbit were not recorded")
        self._log, self.flown = flight.log, flight.actuators
        self._captures, self._disturbance = flown_captures(flight.log), settings.disturbance
        self._robot = self._captures.robot_at(flight.log.first_tick)
        self._outside = np.zeros(3)

    def of(self, start: int, stop: int) -> Momentum:
        """Return the momentum of the rows from ``start`` to before ``stop``."""
        first = self._log.first_tick
        events = [
            tick - first for tick in self._captures.ticks(first + max(start, 1), first + stop)
        ]
        parts, begin = [], start
        for row in [*events, stop]:
            if begin < row:
                parts.append(self._piece(max(begin - 1, 0), begin, row))
            if row < stop:
                self._exchange(row)
                parts.append(self._piece(row, row, row + 1))
            begin = row + 1
        return Momentum(*(np.concatenate(columns) for columns in zip(*parts, strict=True)))

    def _piece(self, before: int, begin: int, stop: int) -> Momentum:
        """Return the momentum of rows under one robot; ``before``: the row that is known."""
        whole = self._momentum(self._robot, self._log.rows(before, stop), self._outside)
        self._outside = whole.outside[-1].copy()
        return Momentum(*(column[begin - before :] for column in whole))

    def _exchange(self, row: int) -> None:
        """Take the events of one tick, one after the other, into what comes from outside."""
        rows = self._log.rows(row - 1, row + 1)
        after = rows.rows(1, 2)
        happening = [
            event
            for event in self._captures.at(after.first_tick)
            if happens_in(self._captures, event, after)
        ]
        self._outside = self._momentum(self._robot, rows, self._outside).outside[-1]
        states = [after]
        for event in reversed(happening):
            states.insert(0, state_before(event, states[0], self.flown.wheels))
        for event, state, then in zip(happening, states[:-1], states[1:], strict=True):
            here = self._momentum(self._robot, state, self._outside).total[0]
            self._robot = event.after
            self._outside = (
                self._outside + self._momentum(self._robot, then, self._outside).total[0] - here
            )

    def _momentum(self, robot: Robot, rows: FlightLog, outside: Array) -> Momentum:
        """Return the momentum of rows; ``outside``: (3,) what had come by the first."""
        axes = body_axes(rows)
        motion = Motion(
            unit_rows(rows.quaternion), rows.omega_base, rows.all_positions, rows.all_velocities
        )
        momentum = robot_momentum(robot, motion)
        wheels = self.flown.wheels
        spin = product(wheels.spin_momenta(rows.wheel_velocities), wheels.unit_axes)
        return Momentum(
            momentum.angular,
            momentum.base,
            to_inertial(axes, spin.T).T,
            motor_momentum(robot, motion.quaternion, motion.joint_positions, rows.motor_velocities),
            outside + self._impulse(rows, axes, momentum.centre_of_mass),
            rows.base_position + momentum.centre_of_mass,
        )

    def _impulse(self, rows: FlightLog, axes: Array, centre: Array) -> Array:
        """Return the angular impulse from outside from the first row to each, (N, 3) N m s."""
        period, flown = rows.timebase.period, self.flown

        def turned(begin: Array, end: Array) -> Array:
            """Return the torque of loads (N-1, 6) on the base at both ends of each interval."""
            sides = (slice(None, -1), begin), (slice(1, None), end)
            at_begin, at_end = (
                torque_about_centre(axes[:, :, side], centre[side], loads[:, :3], loads[:, 3:])
                for side, loads in sides
            )
            return 0.5 * (at_begin + at_end)

        torque = np.zeros((rows.ticks - 1, 3))
        if flown.thruster_count or flown.torquer_count:
            thrusters = flown.thrusters
            force = product(rows.thrusts, thrusters.unit_directions)
            about = product(rows.thrusts, np.cross(thrusters.places, thrusters.unit_directions))
            if flown.torquer_count:  # all on the base that is not of the wheels' motors
                wheel_torque = product(rows.wheel_torques, flown.wheels.unit_axes)
                about = rows.applied_torque[:, :3] + wheel_torque
            loads = np.hstack([force, about])[1:]
            torque += turned(loads, loads)
        if self._disturbance.table:
            begin, end = base_loads(rows, self._disturbance)
            torque += turned(begin[:-1], end[:-1])
        if rows.external_torques.shape[1]:
            torque += rows.external_torques[:-1].reshape(-1, len(SOURCES), 3).sum(axis=1)
        wave = disturbance_impulse(self._disturbance, rows.time)
        impulse = np.zeros((rows.ticks, 3))
        np.cumsum(period * torque, axis=0, out=impulse[1:])
        whole: Array = impulse + (wave - wave[0])[:, np.newaxis]
        return whole


def whole_momentum(log: FlightLog) -> Momentum:
    """Return the momentum of a whole log; raises as `MomentumSeries`."""
    return MomentumSeries(AnalysedLog(log)).of(0, log.ticks)


@series(
    "momentum",
    {
        "momentum_robot": Definition("N m s", "of the robot, its wheels locked", ("max",)),
        "momentum_base": Definition("N m s", "the base's share of that", ("max",)),
        "momentum_wheels": Definition("N m s", "of the wheels' spin", ("max",)),
        "momentum_outside": Definition("N m s", "what came from outside", ("max",)),
        "momentum_drift": Definition(
            "N m s", "of robot and wheels from what is conserved", ("max",)
        ),
        "pushed": Definition(
            "m", "of the whole robot's centre of mass, by thrusters, from its start", ("max", "end")
        ),
    },
    {"momentum_drift.relative": Definition("-", "the drift by the largest momentum of the robot")},
)
def momentum(flight: AnalysedLog) -> TimeSeries | None:
    """Return the sizes of the momentum's parts, of a base that ideal torques do not turn."""
    if not flight.log.flight.get("base_actuators"):
        return None
    # without wheels the robot's momentum is to stay what it was, and says nothing of the drift
    whose = "robot" if flight.actuators.wheel_count else "base"
    names = ["robot", "base", "wheels", "outside", "drift"]
    axes: dict[str, list[int]] = {f"momentum_{name}": [k] for k, name in enumerate(names)}
    if flight.actuators.thruster_count:
        axes["pushed"] = [len(names)]
    tracker, start = MomentumSeries(flight), list[Momentum]()

    def values(begin: int, stop: int) -> Array:
        rows = tracker.of(begin, stop)
        if not start:
            start.append(Momentum(*(column[:1].copy() for column in rows)))
        drift = rows.total - start[0].total - rows.outside
        pushed = rows.centre_of_mass - start[0].centre_of_mass
        parts = (rows.robot, rows.base, rows.wheels, rows.outside, drift, pushed)
        return np.column_stack([norms(part) for part in parts])

    def derive(numbers: dict[str, float]) -> dict[str, float]:
        size = numbers[f"momentum_{whose}.max"]
        drift = numbers["momentum_drift.max"]
        return {"momentum_drift.relative": drift / size} if size else {}

    return TimeSeries(axes, values, derive=derive)


def disturbance_impulse(disturbance: DisturbanceSettings, time: Array) -> Array:
    """(N,) N m s that (61) has given to each inertial axis of the base from 0 to ``time`` (N,) s.

    It acts as friction does, against the torque: ``-integral sin(w t) = (cos(w t) - 1) / w``.
    """
    integral = np.zeros_like(time)
    for frequency in disturbance.base_frequencies:
        if frequency:
            omega = 2.0 * np.pi * frequency
            integral += (np.cos(omega * time) - 1.0) / omega
    impulse: Array = disturbance.scale * disturbance.base_amplitude * integral
    return impulse


def _impact_at(exchange: CaptureEvent, row: FlightLog, wheels: WheelSettings) -> Impact:
    return exchange.impact(
        unit_rows(row.quaternion)[0],
        row.all_positions[0],
        wheels.unit_axes,
        wheels.values("rotor_inertia"),
    )


def happens_in(captures: Captures, exchange: CaptureEvent, row: FlightLog) -> bool:
    """Return whether an event happens in the configuration of its row, see `Captures.happens`.

    That depends on places alone, so that no wheels are needed.
    """
    impact = _impact_at(exchange, row, WheelSettings())
    return captures.happens(exchange, impact, row.base_position[0])


def state_before(exchange: CaptureEvent, row: FlightLog, wheels: WheelSettings) -> FlightLog:
    """Return the one row of an event's tick with the velocities that led to those it has.

    The row is the truth when it has happened; of several events at one tick take the last first.
    """
    axes = body_axes(row)[:, :, 0]
    columns: dict[str, Any] = {name: getattr(row, name)[0] for name in VELOCITIES}
    columns["omega_base"] = product(columns["omega_base"], axes)
    ends = np.cumsum([len(column) for column in columns.values()])[:-1]
    after = np.concatenate(list(columns.values()))
    before = exchange.velocity_before(_impact_at(exchange, row, wheels), after)
    columns = dict(zip(VELOCITIES, np.split(before, ends), strict=True))
    columns["omega_base"] = product(axes, columns["omega_base"])
    return replace(row, **{name: values[np.newaxis] for name, values in columns.items()})


def _has_free_targets(flight: AnalysedLog) -> bool:
    with suppress(ValueError):
        events = flown_events(flight.log)
        return any(isinstance(event, Capture) and event.target.is_in_orbit for event in events)
    return False


@metrics(
    "captures",
    {"missed.{event}": Definition("m", "of the target from where the tool would have held it")},
    applies=_has_free_targets,
)
def missed_captures(flight: AnalysedLog) -> dict[str, float]:
    """Return the distances of the captures that missed their target, and did not happen."""
    log, captures = flight.log, flown_captures(flight.log)
    for tick in captures.ticks(log.first_tick, log.first_tick + log.ticks):
        row = log.rows(tick - log.first_tick, tick - log.first_tick + 1)
        for exchange in captures.at(tick):
            happens_in(captures, exchange, row)
    return {
        f"missed.{exchange.event.label}": captures.misses[exchange.tick]
        for exchange in captures.exchanges
        if exchange.tick in captures.misses and exchange.target_state
    }
