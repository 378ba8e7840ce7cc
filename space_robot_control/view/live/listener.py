"""What a flying robot tells of itself, as often as it is asked and no oftener."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

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
from space_robot_sim.robot import Robot
from space_robot_sim.robot.find import find_robot

from ...flight.graph.monitor import Event, Monitor
from ...flight.graph.node_services import get_parameters
from .finder import PLANT, Place

Array = NDArray[np.float64]

MEASURED: tuple[type[MessageDescription], ...] = (JointStates, BaseState)
TRUE: tuple[type[MessageDescription], ...] = (TruthJoints, TruthBase)
DEPTH = 2
"""Messages kept of a topic: older ones than the newest are of no use."""


class Sample(NamedTuple):
    """The newest that is known of the robot."""

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
    """(n+3,) tracking error as the law sees it; None: not told yet."""


class Listener:
    """Listens to the newest state only: the truth where it is sent, else what the sensors tell."""

    def __init__(self, place: Place, robot: str, check: Callable[[], None]) -> None:
        """Join the graph; ask the plant which robot it is, and for its period.

        Args:
            place: where the plant is.
            robot: name or path of the robot; empty: the plant's.
            check: called while waiting for the plant; raises to give up.

        Raises:
            InputError: its robot is not to be found here.
            FlightError: the plant does not answer.
        """
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self._monitor = Monitor(place.domain, place.namespace, "viewer")
        try:
            self.robot, period = self._ask_plant(robot, check)
            self._group = PolledCallbackGroup()
            self._law = RawSubscription(self._monitor.node, topics.LAW, self._group)
        except BaseException:
            self.close()
            raise
        self._timebase = Timebase(round(period * 1e9))
        self._names = RobotNames.of(self.robot.joint_names, passive=self.robot.passive_names)
        self._state = RobotState.allocate(self.robot.n)
        self._subscriptions: list[tuple[RawSubscription, MessageDescription, Codec]] = []
        self._sources: tuple[type[MessageDescription], ...] = ()
        self._heard: set[topics.Topic] = set()
        self._time = 0.0
        """That of the newest state, s."""
        self.law = ""
        """The law that commands; empty: not told yet."""

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
        self._choose_sources(with_states)
        is_new = False
        for subscription, describe, codec in self._subscriptions:
            if (data := subscription.take_newest()) is not None:
                is_new |= self._read(describe, codec, data)
        if not is_new or len(self._heard) < len(self._sources):
            return None
        state, passive = self._state, len(self._names.passive)
        angles = np.concatenate([state.joint_positions, state.passive_positions[:passive]])
        return Sample(
            self._time, state.base_position.copy(), state.quaternion.copy(), angles,
            state.applied_torque.copy(), self._monitor.error,
        )  # fmt: skip

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._monitor.simulated_s

    @property
    def complaints(self) -> dict[str, str]:
        """The modes of nodes that are not well, by their names, and of a plant with faults."""
        told = self._monitor.values.get(PLANT, {})
        faults = {PLANT: f"faults: {told['faults']}"} if "faults" in told else {}
        return {**faults, **self._monitor.complaints}

    def _choose_sources(self, with_states: bool) -> None:
        from space_robot_msgs_py.ros.endpoints import RawSubscription

        node = self._monitor.node
        sources = TRUE if node.count_publishers(topics.TRUTH_BASE.name) else MEASURED
        sources = sources if with_states else ()
        if sources == self._sources:
            return
        for subscription, _, _ in self._subscriptions:
            subscription.close()
        self._subscriptions, self._sources, self._heard = [], sources, set()
        for kind in sources:
            describe = kind.of_robot(self._names, self._timebase)
            subscription = RawSubscription(node, kind.topic, self._group, DEPTH, best_effort=True)
            self._subscriptions.append((subscription, describe, Codec(describe)))

    def _read(self, describe: MessageDescription, codec: Codec, data: bytes) -> bool:
        """Take the last row of a message into the state; False: it is not of this robot."""
        try:
            stamp_ns, numbers = codec.decode(data)
        except MessageError:
            return False
        rows = numbers.reshape(-1, sum(column.length for column in describe.columns))
        at = 0
        for column in describe.columns:
            target = getattr(self._state, column.name)
            target[column.first : column.first + column.length] = rows[-1, at : at + column.length]
            at += column.length
        self._heard.add(describe.topic)
        self._time = stamp_ns * 1e-9 + (len(rows) - 1) * self._timebase.period
        return True

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
