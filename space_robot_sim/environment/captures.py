"""Captures and releases of a flight, with the resulting robot and the tick of each."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.elementary.matrices import norm
from space_robot_model.robot import Robot
from space_robot_model.robot.dynamics import generalised_rows
from space_robot_msgs_py.simulated_time import tick_from

from .events import Capture, Event
from .impact import Grasp, Impact
from .neighbouring_orbit import TargetState, target_state
from .orbit import OrbitSettings
from .target import TargetMotion

Array = NDArray[np.float64]


class CaptureEvent(NamedTuple):
    """A capture or release at a tick, with the robot before and after it."""

    tick: float
    event: Event
    before: Robot
    after: Robot
    grasp: Grasp
    """Grasp of the target that is captured or released."""
    target_state: TargetState | None = None
    """Of a target on a neighbouring orbit."""

    def impact(
        self, quaternion: Array, joint_positions: Array, wheel_axes: Array, wheel_inertia: Array
    ) -> Impact:
        """Return the impact in a configuration, see `Impact`."""
        holding = self.after if isinstance(self.event, Capture) else self.before
        return Impact(holding, self.grasp, quaternion, joint_positions, wheel_axes, wheel_inertia)

    def velocity_after(self, impact: Impact, velocity: Array) -> Array:
        """Return the velocities after the event, as in `Impact`."""
        if isinstance(self.event, Capture):
            return impact.capture(self._motion(self.event), velocity)
        return impact.release(self.event.speed, velocity)

    def velocity_before(self, impact: Impact, velocity: Array) -> Array:
        """Invert `velocity_after`."""
        if isinstance(self.event, Capture):
            return impact.before_capture(self._motion(self.event), velocity)
        return impact.before_release(self.event.speed, velocity)

    def miss(self, impact: Impact, base_position: Array) -> float:
        """Return by how much the tool misses the target, m; 0 if it reaches it."""
        if self.target_state is None:
            return 0.0
        distance = norm(base_position + impact.place - self.target_state.position)
        return distance if distance > self.target_state.reach else 0.0

    def _motion(self, event: Capture) -> TargetMotion:
        return self.target_state.motion if self.target_state else event.target.motion


class Captures:
    """Events of one flight of a robot; their effect depends only on tick and state."""

    def __init__(
        self, events: Sequence[Event], robot: Robot, period: float, orbit: OrbitSettings
    ) -> None:
        """Place the events, in order of time, in ticks of ``period`` seconds."""
        self._robot = robot
        self.misses: dict[float, float] = {}
        """Distances, m, by tick, of captures that have missed their target."""
        self.exchanges: list[CaptureEvent] = []
        """By their ticks."""
        for event in events:
            tick = tick_from(event.time_s, period)
            if isinstance(event, Capture):
                grasp = Grasp.of(robot, event.target)
                target = event.target
                free = target_state(target, orbit, tick * period) if target.is_in_orbit else None
                exchange = CaptureEvent(tick, event, robot, grasp.holding(robot), grasp, free)
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
        """Return the events at the begin of ``tick``."""
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
        if past and isinstance(past[-1].event, Capture) and past[-1].tick in self.misses:
            return past[-1].before
        return past[-1].after if past else self._robot

    def apply(self, tick: int, model: Model, x: Array) -> bool:
        """Apply the events of ``tick`` to a plant's ``model`` and its state ``x``.

        ``x`` is as in `space_robot_sim.plant.integrator.Stages`. Returns whether any happened.
        """
        happened = False
        for exchange in self.at(tick):
            n, wheels = self._robot.joint_count, int(model.wheel_count)
            row = model.row[:n].astype(np.intp)
            others = wheels + int(model.rotor_count)
            velocities = x[7 + n : 13 + 2 * n + others]
            places = [*generalised_rows(self._robot), *range(6 + n, 6 + n + others)]
            impact = exchange.impact(
                x[3:7], x[7 : 7 + n][row], model.wheel_axis[:wheels], model.wheel_inertia[:wheels]
            )
            if not self.happens(exchange, impact, x[:3]):
                continue
            happened = True
            velocities[places] = exchange.velocity_after(impact, velocities[places])
            # only the carrier changes: wheels and gears are mounted in the plant's model alone
            body, of_robot = exchange.grasp.body, exchange.after.model
            body = 1 + int(row[body - 1]) if body else 0
            for name in ("mass", "inertia", "com"):
                getattr(model, name)[body] = getattr(of_robot, name)[body]
        return happened

    def happens(self, exchange: CaptureEvent, impact: Impact, base_position: Array) -> bool:
        """Return whether an event happens: a capture if the tool is at the target.

        A release after a capture that missed its target does not. Misses are remembered.
        """
        if isinstance(exchange.event, Capture):
            self.misses.pop(exchange.tick, None)
            if distance := exchange.miss(impact, base_position):
                self.misses[exchange.tick] = distance
            return not distance
        capture = self.exchanges[self.exchanges.index(exchange) - 1]
        return capture.tick not in self.misses
