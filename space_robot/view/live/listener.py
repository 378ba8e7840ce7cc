"""Listener to the state of a running robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.base_state import BaseState
from space_robot_msgs_py.wire.codec import Codec
from space_robot_msgs_py.wire.controller_law import LawCodec
from space_robot_msgs_py.wire.joint_states import JointStates
from space_robot_msgs_py.wire.message import MessageDescription
from space_robot_msgs_py.wire.truth_base import TruthBase
from space_robot_msgs_py.wire.truth_joints import TruthJoints

from ...flight.graph.monitor import Event, Monitor
from ...flight.graph.node_names import PLANT
from ...flight.graph.node_services import get_parameters
from .finder import FlightPlace

if TYPE_CHECKING:
    from rclpy.node import Node

    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup

Array = NDArray[np.float64]

MEASURED: tuple[type[MessageDescription], ...] = (JointStates, BaseState)
TRUE: tuple[type[MessageDescription], ...] = (TruthJoints, TruthBase)


KEPT = 4
"""Messages, so that one of the same tick is there on each topic."""


class StateTopic:
    """Takes the messages of a topic; of each the last row is kept for a while."""

    def __init__(
        self, node: Node, group: PolledCallbackGroup, kind: type[MessageDescription]
    ) -> None:
        """Subscribe to the messages of a kind as they come; they are never waited for.

        They can be taken once `describe` has been called. Those that come before are kept.
        """
        from space_robot_msgs_py.ros.endpoints import RawSubscription

        self._kind = kind
        self._subscription = RawSubscription(node, kind.topic, group, KEPT, best_effort=True)
        self.rows: dict[int, Array] = {}
        """The last row of each of the newest messages, by its time in ns."""

    def describe(self, names: RobotNames, timebase: Timebase) -> None:
        """Set the robot that the messages are of, and the period of its ticks."""
        self._describe = self._kind.of_robot(names, timebase)
        self._codec = Codec(self._describe)
        self._width = sum(column.length for column in self._describe.columns)
        self._period_ns = timebase.period_ns

    def take(self) -> None:
        """Take what has come; messages that are not of this robot are passed over."""
        while (data := self._subscription.take()) is not None:
            try:
                stamp_ns, numbers = self._codec.decode(data)
            except MessageError:
                continue
            rows = numbers.reshape(-1, self._width)
            self.rows[stamp_ns + (len(rows) - 1) * self._period_ns] = rows[-1].copy()
        while len(self.rows) > KEPT:
            del self.rows[next(iter(self.rows))]

    def fill(self, state: RobotState, stamp_ns: int) -> None:
        """Put the row of a time into the columns of a state that the topic has."""
        row, at = self.rows[stamp_ns], 0
        for column in self._describe.columns:
            target = getattr(state, column.name)
            target[column.first : column.first + column.length] = row[at : at + column.length]
            at += column.length

    def close(self) -> None:
        """Take no more messages."""
        self._subscription.close()


class Sample(NamedTuple):
    """Newest known state of the robot."""

    time: float
    """s, simulated."""
    base_position: Array
    """(3,) m, inertial frame."""
    base_quaternion: Array
    """(4,) ``[w, x, y, z]``."""
    angles: Array
    """(N,) of all joints, the passive ones behind; rad, or m of prismatic ones."""
    torque: Array
    """(n+3,) N m applied over the last tick; base, then joints."""
    error: Array | None
    """(n+3,) tracking error as the law sees it; None: not received yet."""


class Listener:
    """Subscriber of the newest state: the true one if published, else the measured one."""

    def __init__(self, place: FlightPlace, robot: str, check: Callable[[], None]) -> None:
        """Join the graph; ask the plant which robot it is, and for its period.

        Args:
            place: where the plant is.
            robot: name or path of the robot; empty: the plant's.
            check: called while waiting for the plant; raises to give up.

        Raises:
            InputError: the files of its robot do not exist on this machine.
            FlightError: the plant does not answer.
        """
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self._monitor = Monitor(place.domain, place.namespace, "viewer")
        self._group = PolledCallbackGroup()
        self._topics: dict[type[MessageDescription], StateTopic] = {}
        try:
            # before the plant is asked: a short flight may be over when it has answered
            for kind in (*MEASURED, *TRUE):
                self._topics[kind] = StateTopic(self._monitor.node, self._group, kind)
            self._law = RawSubscription(self._monitor.node, topics.LAW, self._group)
            self.robot, period = self._ask_plant(robot, check)
        except BaseException:
            self.close()
            raise
        self._timebase = Timebase(round(period * 1e9))
        self._names = RobotNames.of(self.robot.joint_names, passive=self.robot.passive_names)
        for topic in self._topics.values():
            topic.describe(self._names, self._timebase)
        self._state = RobotState.allocate(self.robot.n)
        self._stamp_ns: int | None = None
        """The newest sample's time."""
        self.law = ""
        """Name of the law in force; empty: not received yet."""

    def _ask_plant(self, robot: str, check: Callable[[], None]) -> tuple[Robot, float]:
        name = period = None
        while not (name and period):  # a plant that is not configured yet has neither
            check()
            name, period = get_parameters(self._monitor.node, PLANT, ["robot", "period"], check)
        try:
            return find_robot(robot or str(name)), float(period)
        except InputError as error:
            if robot:
                raise
            raise InputError(f"the plant's robot: {error}; --robot tells which it is") from None

    def poll(self, with_states: bool, events: list[Event]) -> Sample | None:
        """Return the newest sample, if there is a new one.

        Args:
            with_states: False: nobody looks, so that no state need be sent here.
            events: to which is added what has happened.
        """
        events += self._monitor.poll()
        while (data := self._law.take()) is not None:
            events += self._read_law(data)
        self._choose_topics(with_states)
        stamp_ns = self._newest_of_all()
        if stamp_ns is None or stamp_ns == self._stamp_ns:
            return None
        self._stamp_ns = stamp_ns
        for topic in self._topics.values():
            topic.fill(self._state, stamp_ns)
        state, passive = self._state, len(self._names.passive)
        angles = np.concatenate([state.joint_positions, state.passive_positions[:passive]])
        return Sample(
            1e-9 * stamp_ns,
            state.base_position.copy(),
            state.quaternion.copy(),
            angles,
            state.applied_torque.copy(),
            self._monitor.error,
        )

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._monitor.simulated_s

    @property
    def complaints(self) -> dict[str, str]:
        """The modes of nodes that are not well, by their names, and of a plant with faults."""
        values = self._monitor.values.get(PLANT, {})
        faults = {PLANT: f"faults: {values['faults']}"} if "faults" in values else {}
        return {**faults, **self._monitor.complaints}

    def _choose_topics(self, with_states: bool) -> None:
        """Subscribe to the true states if they are published, else to the measured ones."""
        for topic in self._topics.values():
            topic.take()
        heard = TruthBase in self._topics and bool(self._topics[TruthBase].rows)
        is_sent = bool(self._monitor.node.count_publishers(topics.TRUTH_BASE.name))
        kinds = (TRUE if is_sent or heard else MEASURED) if with_states else ()
        for kind in [kind for kind in self._topics if kind not in kinds]:
            self._topics.pop(kind).close()
        for kind in kinds:
            if kind not in self._topics:
                topic = StateTopic(self._monitor.node, self._group, kind)
                topic.describe(self._names, self._timebase)
                self._topics[kind] = topic

    def _newest_of_all(self) -> int | None:
        """Return the newest time for which each topic has a row: base and arm of one tick."""
        times = [set(topic.rows) for topic in self._topics.values()]
        return max(set.intersection(*times), default=None) if times else None

    def _read_law(self, data: bytes) -> list[Event]:
        try:
            before, self.law = self.law, LawCodec.decode(data, 0).name
        except MessageError:
            return []
        is_news = bool(before) and before != self.law
        return [Event(self.time, "controller_node", f"flies {self.law}")] if is_news else []

    def close(self) -> None:
        """Leave the graph."""
        self._monitor.close()
