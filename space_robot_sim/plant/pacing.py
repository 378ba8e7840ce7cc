"""When a tick may begin and end: the wall clock, pause and step, late and missing listeners."""

from __future__ import annotations

import math
import time
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

from space_robot_msgs_py.errors import FlightError, InputError

from .settings import PlantNodeSettings

if TYPE_CHECKING:  # the rest is also used where ROS is missing
    from space_robot_msgs_py.ros.endpoints import RawSubscription
    from space_robot_msgs_py.ros.managed_node import ManagedNode

SPIN_BEFORE_DEADLINE_S = 100e-6
"""The last part of the wait for a deadline, in which the plant polls and does not sleep, s."""
SLIP_S = 0.25
"""A flight further behind the wall clock does not catch up."""
REMARK_S = 5.0
"""Least time between two remarks on lost time, s."""


class WallClock:
    """Deadlines at a fixed period, never drifting; they slip as a whole when hopelessly missed."""

    def __init__(self, period: float) -> None:
        self._period = period
        self._begin = 0.0
        self.lost_time_s = 0.0
        """Time that the flight will not catch up."""
        self._remarked_s, self._remarked_at = 0.0, -math.inf

    def start(self, tick: int) -> None:
        """Begin ``tick`` now."""
        self._begin = time.monotonic() - tick * self._period

    def left(self, tick: int) -> float:
        """Return the time until ``tick`` is over, s; negative if it is."""
        # from the begin of all ticks: errors of single ones do not add up
        return self._begin + (tick + 1) * self._period - time.monotonic()

    def slip(self, tick: int) -> float:
        """Set the deadlines back if ``tick`` was over long ago; return by how much, s."""
        behind = -self.left(tick)
        if behind < SLIP_S:
            return 0.0
        self._begin += behind
        self.lost_time_s += behind
        return behind

    def remark(self) -> str:
        """Return a remark on the time lost since the last one; empty if that was just now."""
        now = time.monotonic()
        lost, since = self.lost_time_s - self._remarked_s, now - self._remarked_at
        if since < REMARK_S or not lost:
            return ""
        within = f" in {since:.1f} s, {self.lost_time_s:.3f} s in all" if self._remarked_s else ""
        self._remarked_s, self._remarked_at = self.lost_time_s, now
        return f"{lost:.3f} s behind the wall clock{within}: time goes on from here"


PAUSED = "paused"
"""The mode of a paused plant in its diagnostics."""


class RunControl:
    """Holds the plant at a tick. Independent of ROS.

    A plant that is held has sent its state and taken the answer to it; it does not integrate. So a
    flight that was paused and stepped has the states and commands of one that was not.
    """

    def __init__(self, is_paused: bool = False) -> None:
        """Run; or, if it ``is_paused``, hold the plant at tick 0."""
        self._hold_at: float = 0 if is_paused else math.inf
        self.tick = 0
        """The present one."""
        self.is_at_rest = False
        """True if the plant must stay at the present tick."""

    @property
    def is_paused(self) -> bool:
        """True from a pause until the plant runs on, also while it is stepped."""
        return self._hold_at < math.inf

    @property
    def is_held(self) -> bool:
        """True if it is paused and where it should be, with nothing left to do at this tick."""
        return self.is_at_rest and self.tick >= self._hold_at

    def begin(self, tick: int) -> None:
        """Let ``tick`` be the present one."""
        self.tick, self.is_at_rest = tick, False

    def holds(self) -> bool:
        """Return whether the plant must stay at the present tick; call when all else is done."""
        self.is_at_rest = self.is_at_rest or self.tick >= self._hold_at
        return self.tick >= self._hold_at

    def pause(self) -> bool:
        """Hold the plant at the present tick, even within a step; False if it is paused there."""
        if self.tick >= self._hold_at:
            return False
        self._hold_at = self.tick
        return True

    def resume(self) -> bool:
        """Let the plant run on; False if it was not paused."""
        was_paused = self.is_paused
        self._hold_at = math.inf
        return was_paused

    def step(self, ticks: int) -> int:
        """Let the plant go ``ticks`` further; return the tick at which it is held then."""
        if ticks < 1:
            raise InputError(f"a step takes 1 tick or more, got {ticks}")
        if not self.is_paused:
            raise InputError("it is not paused: only a paused simulation can be stepped")
        if self.tick < self._hold_at:
            raise InputError(f"a step to tick {self._hold_at} is under way")
        self._hold_at = self.tick + ticks
        return self.tick + ticks


REPEAT_EVERY_S, REPEAT_FOR_S = 0.5, 2.0
"""Repetition of messages for a new listener, which may miss the first ones as best effort."""


class LateListeners:
    """Decision when a paused plant repeats its last messages. Independent of ROS."""

    def __init__(self, outputs: Sequence[Any]) -> None:
        """``outputs``: publishers, whose new listeners are those meant."""
        self._outputs = outputs
        self._counts: list[int] | None = None
        self._until = self._next = 0.0

    def begin(self) -> None:
        """Begin a tick: present listeners get its messages."""
        self._counts = None

    def are_due(self, now: float) -> bool:
        """Return whether messages must be repeated for new listeners, at a time in s."""
        before = self._counts
        self._counts = [output.listener_count for output in self._outputs]
        if before and any(a > b for a, b in zip(self._counts, before, strict=True)):
            self._next, self._until = now, now + REPEAT_FOR_S
        if not self._next <= now < self._until:
            return False
        self._next = now + REPEAT_EVERY_S
        return True


DISCOVERY_S = 2.0
"""Until all nodes have discovered one that has just been discovered by one of them (measured with
Fast DDS of Jazzy: 0.1 to 1.8 s). The recorder would miss commands sent before."""


class ControllerWatch:
    """Decides whether a plant waits for its controller, and when the flight ends without one."""

    def __init__(
        self,
        node: ManagedNode[PlantNodeSettings],
        command: RawSubscription,
        settings: PlantNodeSettings,
    ) -> None:
        """``command``: the plant's subscription to what the controller publishes."""
        self._node, self._topic, self._settings = node, command.full_name, settings
        self.is_missing = settings.own_controller
        """True until there is a controller."""
        self._since = self._discovered_at = 0.0

    def is_awaited(self) -> bool:
        """Return whether the first state must wait for the controller."""
        if not self.is_missing:
            return False
        now = time.monotonic()
        self._since = self._since or now
        if not self._node.count_publishers(self._topic):
            self._discovered_at = 0.0
            self.check_first(now - self._since)
        else:
            self._discovered_at = self._discovered_at or now
            self.is_missing = now < self._discovered_at + DISCOVERY_S
        return self.is_missing

    def check_first(self, waited_s: float, refused: Mapping[str, int] | None = None) -> None:
        """Check that the first command, awaited for ``waited_s``, is not overdue.

        ``refused`` counts refused commands by reason.
        """
        limit = self._settings.join_timeout
        if not limit or waited_s <= limit:
            return
        reasons = ", ".join(f"{reason} ({count})" for reason, count in (refused or {}).items())
        raise FlightError(
            f"no good command for tick 0 within {limit:g} s (join_timeout): {self._publishers()}"
            + (f"; refused: {reasons}" if reasons else "")
        )

    def check_silence(self, tick: int) -> None:
        """Check that a plant may fly on though its controller is silent."""
        if self._settings.own_controller:
            raise FlightError(
                f"no command for {self._settings.silence_timeout:g} s (silence_timeout) at "
                f"{tick * self._settings.period:.4f} s: the controller is silent; "
                f"{self._publishers()}"
            )

    def _publishers(self) -> str:
        from space_robot_msgs_py.ros.endpoints import full_node_name

        infos = self._node.get_publishers_info_by_topic(self._topic)
        names = ", ".join(sorted(map(full_node_name, infos))) or "none"
        domain = self._node.context.get_domain_id()
        return f"publishers of {self._topic} in ROS domain {domain}: {names}"
