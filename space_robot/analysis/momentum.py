"""Angular momentum of robot and wheels about their common centre of mass, on inertial axes.

The base's inertia in the robot's file includes its wheels, locked. So the robot's momentum is
that of everything with locked wheels, and the wheels' is what their spin relative to the base adds,
``sum a_k J_k Omega_k``. So it is with the rotors of motors behind gears. Motors and joints only
move it from one to the other: the sum changes by what comes from outside, that is thrusters,
magnetic torquers, the disturbances of (61) and of the user's own, what acts in orbit, and what a
captured or released target has, and by nothing else.
"""

from __future__ import annotations

from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import norm, product, unit_rows
from space_robot_model.hardware.base_actuators import BaseActuatorSettings, WheelSettings
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import motor_momentum
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, to_inertial
from space_robot_msgs_py.bag.flight_log import FlightLog, Metric, joined, last_rows
from space_robot_msgs_py.samples import SOURCES
from space_robot_sim.environment.captures import CaptureEvent, Captures
from space_robot_sim.environment.disturbance import DisturbanceSettings
from space_robot_sim.environment.impact import Impact

from .base_demand import axes_of
from .external_torques import base_loads, torque_about_centre

Array = NDArray[np.float64]


def impact_at(exchange: CaptureEvent, row: FlightLog, wheels: WheelSettings) -> Impact:
    """Return the impact of an event in the configuration of a row."""
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
    impact = impact_at(exchange, row, WheelSettings())
    return captures.happens(exchange, impact, row.base_position[0])


def state_before(exchange: CaptureEvent, row: FlightLog, wheels: WheelSettings) -> FlightLog:
    """Return the one row of an event's tick with the velocities that led to those it has.

    Args:
        exchange: the event; of several at one tick the last one.
        row: the truth at its tick, when it has happened.
        wheels: of the base.
    """
    n, p = len(row.joint_names), len(row.passive_names)
    quaternion = row.quaternion[0] / norm(row.quaternion[0])
    axes = base_axes(quaternion[:, np.newaxis])[:, :, 0]
    after = np.concatenate(
        [
            row.base_velocity[0],
            product(row.omega_base[0], axes),
            row.all_velocities[0],
            row.wheel_velocities[0],
            row.motor_velocities[0],
        ]
    )
    before = exchange.velocity_before(impact_at(exchange, row, wheels), after)
    columns: dict[str, Any] = {
        "base_velocity": before[:3],
        "omega_base": product(axes, before[3:6]),
        "joint_velocities": before[6 : 6 + n],
        "passive_velocities": before[6 + n : 6 + n + p],
        "wheel_velocities": before[6 + n + p : 6 + n + p + wheels.count],
        "motor_velocities": before[6 + n + p + wheels.count :],
    }
    return replace(row, **{name: values[np.newaxis] for name, values in columns.items()})


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
    """Follows the momentum through a flight, block by block.

    At the tick of a capture or release it is that after it; the change is from outside.
    """

    def __init__(
        self, captures: Captures, flown: BaseActuatorSettings, disturbance: DisturbanceSettings
    ) -> None:
        """``captures``: of the robot that flew, payload included; ``flown``: what turned it."""
        self._captures, self.flown, self._disturbance = captures, flown, disturbance
        self._part: _OfOneRobot | None = None

    def add(self, log: FlightLog) -> Momentum:
        """Take further rows of the flight and return their momentum."""
        start, stop = log.first_tick, log.first_tick + log.ticks
        if self._part is None:  # the first state that is known is that after the first tick's
            self._part = self._begin(self._captures.robot_at(start), np.zeros(3))
            start += 1
        momentum, begin = [], log.first_tick
        for tick in self._captures.ticks(start, stop):
            if tick > begin:
                momentum.append(self._part.add(_rows(log, begin, tick)))
            momentum.append(self._exchange(_rows(log, tick, tick + 1)))
            begin = tick + 1
        if begin < stop:
            momentum.append(self._part.add(_rows(log, begin, stop)))
        return Momentum(*(np.concatenate(columns) for columns in zip(*momentum, strict=True)))

    def _begin(self, robot: Robot, outside: Array) -> _OfOneRobot:
        return _OfOneRobot(robot, self.flown, self._disturbance, outside)

    def _exchange(self, row: FlightLog) -> Momentum:
        """Take the tick of one event or several, as they happen one after the other."""
        exchanges = [
            exchange
            for exchange in self._captures.at(row.first_tick)
            if happens_in(self._captures, exchange, row)
        ]
        assert self._part is not None
        if not exchanges:
            return self._part.add(row)
        states = [row]
        for exchange in reversed(exchanges):
            states.insert(0, state_before(exchange, states[0], self.flown.wheels))
        for exchange, state, after in zip(exchanges, states[:-1], states[1:], strict=True):
            before = self._part.add(state)
            bare = self._begin(exchange.after, np.zeros(3)).add(after)
            outside = before.outside[0] + bare.total[0] - before.total[0]
            self._part = self._begin(exchange.after, outside)
            momentum = self._part.add(after)
        return momentum


class _OfOneRobot:
    """Follows the momentum of a robot that holds the same all the time."""

    def __init__(
        self,
        robot: Robot,
        flown: BaseActuatorSettings,
        disturbance: DisturbanceSettings,
        outside: Array,
    ) -> None:
        """``outside``: (3,) N m s that have come from outside at the first row."""
        self._robot, self._flown, self._disturbance = robot, flown, disturbance
        self._before: FlightLog | None = None
        self._outside = outside

    def add(self, log: FlightLog) -> Momentum:
        """Take further rows, see `MomentumSeries.add`."""
        rows = joined(self._before, log)
        axes, skipped = axes_of(rows), rows.ticks - log.ticks
        motion = Motion(
            unit_rows(rows.quaternion), rows.omega_base, rows.all_positions, rows.all_velocities
        )
        momentum = robot_momentum(self._robot, motion)
        wheels = self._flown.wheels
        spin = product(wheels.spin_momenta(rows.wheel_velocities), wheels.unit_axes)
        outside = self._from_outside(rows, axes, momentum.centre_of_mass)
        self._before, self._outside = last_rows(log, 1), outside[-1].copy()
        whole = Momentum(
            momentum.angular,
            momentum.base,
            to_inertial(axes, spin.T).T,
            motor_momentum(
                self._robot, motion.quaternion, motion.joint_positions, rows.motor_velocities
            ),
            outside,
            rows.base_position + momentum.centre_of_mass,
        )
        return Momentum(*(values[skipped:] for values in whole))

    def _from_outside(self, rows: FlightLog, axes: Array, centre_of_mass: Array) -> Array:
        """Return the angular impulse up to each row, the first row's known, (N, 3) N m s."""
        period, time = rows.timebase.period, rows.time
        impulse = np.zeros((rows.ticks, 3))
        if self._flown.thruster_count or self._flown.torquer_count:
            thrusters = self._flown.thrusters
            force = product(rows.thrusts, thrusters.unit_directions)
            arms = np.cross(thrusters.places, thrusters.unit_directions)
            torque = product(rows.thrusts, arms)
            if self._flown.torquer_count:  # all on the base that is not of the wheels' motors
                wheels = product(rows.wheel_torques, self._flown.wheels.unit_axes)
                torque = rows.applied_torque[:, :3] + wheels
            each = [  # turned as the base is before and after the interval
                torque_about_centre(side, centre, force[1:], torque[1:])
                for side, centre in (
                    (axes[:, :, :-1], centre_of_mass[:-1]),
                    (axes[:, :, 1:], centre_of_mass[1:]),
                )
            ]
            impulse[1:] = 0.5 * period * np.cumsum(each[0] + each[1], axis=0)
        if self._disturbance.table:
            before, after = base_loads(rows, self._disturbance)
            each = [
                torque_about_centre(side, centre, loads[:-1, :3], loads[:-1, 3:])
                for side, centre, loads in (
                    (axes[:, :, :-1], centre_of_mass[:-1], before),
                    (axes[:, :, 1:], centre_of_mass[1:], after),
                )
            ]
            impulse[1:] += 0.5 * period * np.cumsum(each[0] + each[1], axis=0)
        if rows.external_torques.shape[1]:
            by_axis = rows.external_torques[:-1].reshape(-1, len(SOURCES), 3).sum(axis=1)
            impulse[1:] += period * np.cumsum(by_axis, axis=0)
        wave = disturbance_impulse(self._disturbance, time)
        outside: Array = self._outside + impulse + (wave - wave[0])[:, np.newaxis]
        return outside


class MomentumBudget(Metric):
    """Largest momentum of each part, and how far the sum is from being conserved."""

    def __init__(self, series: MomentumSeries) -> None:
        self._series, self._flown = series, series.flown
        self._start: Momentum | None = None
        self._largest = dict.fromkeys(("robot", "base", "wheels", "outside"), 0.0)
        self._drift = self._pushed = self._end = 0.0

    def add(self, log: FlightLog, error: Array) -> None:
        """Take further rows."""
        momentum = self._series.add(log)
        if self._start is None:
            self._start = Momentum(*(values[:1].copy() for values in momentum))
        start = self._start
        for name in self._largest:
            self._largest[name] = max(self._largest[name], _longest(getattr(momentum, name)))
        self._drift = max(self._drift, _longest(momentum.total - start.total - momentum.outside))
        pushed = np.linalg.norm(momentum.centre_of_mass - start.centre_of_mass, axis=1)
        self._pushed, self._end = max(self._pushed, float(pushed.max())), float(pushed[-1])

    def result(self) -> dict[str, Any]:
        """Return the largest sizes, N m s, the drift of the sum, and how far thrusters pushed, m.

        The drift is relative to the largest momentum of the robot; where there are no wheels, to
        that of its base, for the robot's is then to stay what it was.
        """
        size = self._largest["robot" if self._flown.wheel_count else "base"]
        pushed = {"max": self._pushed, "end": self._end} if self._flown.thruster_count else None
        return {
            "peak_n_m_s": dict(self._largest),
            "drift": {"n_m_s": self._drift, "relative": self._drift / size if size else None},
            "pushed_m": pushed,
        }


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


def _rows(log: FlightLog, start: int, stop: int) -> FlightLog:
    """Return the rows of the ticks from ``start`` to before ``stop``."""
    return log.rows(start - log.first_tick, stop - log.first_tick)


def _longest(vectors: Array) -> float:
    return float(np.linalg.norm(vectors, axis=1).max())
