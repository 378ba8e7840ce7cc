"""Captures and releases of a flight, with the resulting robot and the tick of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import generalised_rows
from space_robot_msgs_py.simulated_time import tick_from

from .events import Capture, Event, in_order
from .grasp import Grasp
from .impact import Impact

Array = NDArray[np.float64]


class CaptureEvent(NamedTuple):
    """A capture or release at a tick, with the robot before and after it."""

    tick: float
    event: Event
    before: Robot
    after: Robot
    grasp: Grasp
    """Grasp of the target that is captured or released."""

    def impact(
        self, quaternion: Array, joint_positions: Array, wheel_axes: Array, wheel_inertia: Array
    ) -> Impact:
        """Return the impact in a configuration, see `Impact`."""
        holding = self.after if isinstance(self.event, Capture) else self.before
        return Impact(holding, self.grasp, quaternion, joint_positions, wheel_axes, wheel_inertia)

    def velocity_after(self, impact: Impact, velocity: Array) -> Array:
        """Return the velocities after the event, as in `Impact`."""
        if isinstance(self.event, Capture):
            return impact.capture(self.event.target.motion, velocity)
        return impact.release(self.event.speed, velocity)

    def velocity_before(self, impact: Impact, velocity: Array) -> Array:
        """Invert `velocity_after`."""
        if isinstance(self.event, Capture):
            return impact.before_capture(self.event.target.motion, velocity)
        return impact.before_release(self.event.speed, velocity)


class Captures:
    """Events of one flight of a robot; their effect depends only on tick and state."""

    def __init__(self, events: Sequence[Event], robot: Robot, period: float) -> None:
        """Place the events in ticks of ``period`` seconds.

        Raises:
            InputError: the order of events is invalid, or ``robot`` lacks a tool.
        """
        self._robot = robot
        self.exchanges: list[CaptureEvent] = []
        """By their ticks."""
        for event in in_order(events):
            tick = tick_from(event.time_s, period)
            if isinstance(event, Capture):
                grasp = Grasp.of(robot, event.target)
                exchange = CaptureEvent(tick, event, robot, grasp.holding(robot), grasp)
            else:
                last = self.exchanges[-1]
                exchange = CaptureEvent(tick, event, last.after, robot, last.grasp)
            self.exchanges.append(exchange)
            exchange.impact(*self._at_zero)  # its compiled code is loaded now, not in flight

    @property
    def _at_zero(self) -> tuple[Array, Array, Array, Array]:
        """A configuration of the robot, for `CaptureEvent.impact`."""
        joints = np.zeros(self._robot.joint_count)
        return np.array([1.0, 0.0, 0.0, 0.0]), joints, np.zeros((0, 3)), np.zeros(0)

    def at(self, tick: int) -> list[CaptureEvent]:
        """Return the event at the begin of ``tick``."""
        return [exchange for exchange in self.exchanges if exchange.tick == tick]

    def ticks(self, start: int, stop: int) -> list[int]:
        """Return the ticks of events from ``start`` to before ``stop``."""
        return sorted({int(e.tick) for e in self.exchanges if start <= e.tick < stop})

    def next_tick(self, tick: int) -> float:
        """Return the first tick after ``tick`` with an event (inf: none)."""
        return next((e.tick for e in self.exchanges if e.tick > tick), math.inf)

    def robot_at(self, tick: float) -> Robot:
        """Return the robot, with its captured target, after the begin of ``tick``."""
        past = [exchange for exchange in self.exchanges if exchange.tick <= tick]
        return past[-1].after if past else self._robot

    def apply(self, tick: int, model: Model, x: Array) -> bool:
        """Apply the events of ``tick`` to a plant's ``model`` and its state ``x``.

        ``x`` is as in `space_robot_sim.plant.integrator.Stages`. Returns whether there are any.
        """
        exchanges = self.at(tick)
        for exchange in exchanges:
            n, wheels = self._robot.joint_count, int(model.wheel_count)
            row = model.row[:n].astype(np.intp)
            velocities = x[7 + n : 13 + 2 * n + wheels]
            places = [*generalised_rows(self._robot), *range(6 + n, 6 + n + wheels)]
            impact = exchange.impact(
                x[3:7], x[7 : 7 + n][row], model.wheel_axis[:wheels], model.wheel_inertia[:wheels]
            )
            velocities[places] = exchange.velocity_after(impact, velocities[places])
            body, of_robot = exchange.grasp.body, exchange.after.model
            body = 1 + int(row[body - 1]) if body else 0
            for name in ("mass", "inertia", "com"):
                getattr(model, name)[body] = getattr(of_robot, name)[body]
        return bool(exchanges)
