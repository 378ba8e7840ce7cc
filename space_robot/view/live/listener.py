"""Subscriptions to the state of a running robot."""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.orbit.elements import state_of
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot
from space_robot_msgs_py import topics
from space_robot_msgs_py.config.files import nest
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.config.validation import StrictModel, validate
from space_robot_msgs_py.errors import InputError, MessageError
from space_robot_msgs_py.samples import RobotNames, RobotState, Timebase
from space_robot_msgs_py.wire.telemetry import LawCodec
from space_robot_sim.environment.orbit import OrbitSettings

from ...flight.graph.monitor import Event, Monitor
from ...flight.graph.node_names import PLANT
from ...flight.graph.node_services import get_parameters
from .finder import FlightPlace
from .state_topic import StateTopic

Array = NDArray[np.float64]
Schema = TypeVar("Schema", bound=StrictModel)

MEASURED = (topics.JOINT_STATES, topics.BASE_STATE)


class Sample(NamedTuple):
    """Newest received state of the robot."""

    time: float
    """Simulated time, s."""
    base_position: Array
    """(3,) position of the base, m, inertial frame."""
    base_quaternion: Array
    """(4,) attitude of the base, ``[w, x, y, z]``."""
    angles: Array
    """(N,) positions of all joints, passive ones last; rad, or m for prismatic ones."""
    torque: Array
    """(n+3,) torque applied over the last tick, N m; base, then joints."""
    error: Array | None
    """(n+3,) tracking error of the law; None: not received yet."""
    wheels: Array
    """(2, W) newest speeds, rad/s, and motor torques, N m, of the wheels."""
    thrusts: Array
    """(T,) newest thrusts, N."""
    orbit: Array | None
    """(6,) newest position, m, and velocity, m/s, of the origin in its orbit; None: no orbit."""


class Listener:
    """Receives the newest state: the true one if it is published, else the measured one."""

    def __init__(self, place: FlightPlace, robot: str, check: Callable[[], None]) -> None:
        """Join the graph; request robot and period from the plant's parameters.

        Args:
            place: domain and namespace of the plant.
            robot: name or path of the robot; empty: the plant's.
            check: called while waiting for the plant; may raise an error to stop.

        Raises:
            InputError: the files of its robot do not exist on this machine.
            FlightError: the plant does not answer.
        """
        from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

        self._monitor = Monitor(place.domain, place.namespace, "viewer")
        self._group = PolledCallbackGroup()
        self._topics: dict[topics.Topic, StateTopic] = {}
        try:
            # before the request: a short flight may be over when the plant has answered
            for kind in (*MEASURED, *topics.TRUTH):
                self._topics[kind] = StateTopic(self._monitor.node, self._group, kind)
            self._law = RawSubscription(self._monitor.node, topics.LAW, self._group)
            self.robot, period = self._ask_plant(robot, check)
            self.orbit = self._ask_orbit(check)
            self.actuators = self._ask(BaseActuatorSettings, check) or BaseActuatorSettings()
        except BaseException:
            self.close()
            raise
        self._timebase = Timebase(round(period * 1e9))
        self._names = RobotNames(self.robot.joint_names, passive=self.robot.passive_names)
        for topic in self._topics.values():
            topic.describe(self._names, self._timebase)
        self._hardware_names = self.actuators.robot_names(self.robot)
        self._newest_topics: dict[topics.Topic, StateTopic] = {}
        """Topics of which the newest row is taken, whatever its tick."""
        self._state = RobotState.allocate(self.robot.n)
        if self.orbit:
            start = state_of(self.orbit.orbital_elements)
            self._state.orbit_position[:], self._state.orbit_velocity[:] = start
        self._stamp_ns: int | None = None
        """Time of the newest sample."""
        self.law = ""
        """Name of the active law; empty: not received yet."""

    def _ask_plant(self, robot: str, check: Callable[[], None]) -> tuple[Robot, float]:
        name = period = None
        while not (name and period):  # an unconfigured plant has neither
            check()
            name, period = get_parameters(self._monitor.node, PLANT, ["robot", "period"], check)
        try:
            own = find_robot(str(name))
        except InputError as error:
            if not robot:
                raise InputError(f"the plant's robot: {error}; choose it with --robot") from None
            return find_robot(robot), float(period)
        if robot:
            springs = dict(zip(own.passive_names, own.springs, strict=True))
            own = find_robot(robot).with_springs(springs)
        return own, float(period)

    def _ask_orbit(self, check: Callable[[], None]) -> OrbitSettings | None:
        """Return the orbit of the plant; None: it has none, or is of a version without."""
        orbit = self._ask(OrbitSettings, check)
        return orbit if orbit and orbit.has_orbit else None

    def _ask(self, schema: type[Schema], check: Callable[[], None]) -> Schema | None:
        """Return some of the plant's parameters; None: it is of a version without."""
        names = [name for name, _ in leaves(schema)]
        values = get_parameters(self._monitor.node, PLANT, names, check)
        if any(value is None for value in values):
            return None
        tree = nest(dict(zip(names, values, strict=True)))
        return validate(schema, tree, "the plant's parameters")

    def poll(self, with_states: bool, events: list[Event]) -> Sample | None:
        """Return the newest sample; None if there is no new one.

        Args:
            with_states: False: do not subscribe to states, since no browser is open.
            events: new events are appended to it.
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
        self._take_newest()
        state, passive = self._state, len(self._names.passive)
        wheels, thrusters = self.actuators.wheel_count, self.actuators.thruster_count
        angles = np.concatenate([state.joint_positions, state.passive_positions[:passive]])
        return Sample(
            1e-9 * stamp_ns,
            state.base_position.copy(),
            state.quaternion.copy(),
            angles,
            state.applied_torque.copy(),
            self._monitor.error,
            np.array([state.wheel_velocities[:wheels], state.wheel_torques[:wheels]]),
            state.thrusts[:thrusters].copy(),
            np.concatenate([state.orbit_position, state.orbit_velocity]) if self.orbit else None,
        )

    def _take_newest(self) -> None:
        """Take what changes little in a few ticks: orbit, wheels and thrusters."""
        kinds = [topics.TRUTH_ORBIT] if self.orbit else []
        kinds += [topics.WHEELS_STATE] if self.actuators.wheel_count else []
        kinds += [topics.THRUSTERS_STATE] if self.actuators.thruster_count else []
        for kind in kinds:
            if kind not in self._newest_topics:
                topic = StateTopic(self._monitor.node, self._group, kind)
                topic.describe(self._hardware_names, self._timebase)
                self._newest_topics[kind] = topic
            topic = self._newest_topics[kind]
            topic.take()
            if rows := topic.rows:
                topic.fill(self._state, max(rows))

    @property
    def time(self) -> float:
        """Simulated time, s."""
        return self._monitor.simulated_s

    @property
    def complaints(self) -> dict[str, str]:
        """Modes of nodes that are not in normal operation, by name, and faults of the plant."""
        values = self._monitor.values.get(PLANT, {})
        faults = {PLANT: f"faults: {values['faults']}"} if "faults" in values else {}
        return {**faults, **self._monitor.complaints}

    def _choose_topics(self, with_states: bool) -> None:
        """Subscribe to the true states if they are published, else to the measured ones."""
        for topic in self._topics.values():
            topic.take()
        truth = self._topics.get(topics.TRUTH_BASE)
        heard = truth is not None and bool(truth.rows)
        is_sent = bool(self._monitor.node.count_publishers(topics.TRUTH_BASE.name))
        kinds = (topics.TRUTH if is_sent or heard else MEASURED) if with_states else ()
        for kind in [kind for kind in self._topics if kind not in kinds]:
            self._topics.pop(kind).close()
        while self._newest_topics and not with_states:
            self._newest_topics.popitem()[1].close()
        for kind in kinds:
            if kind not in self._topics:
                topic = StateTopic(self._monitor.node, self._group, kind)
                topic.describe(self._names, self._timebase)
                self._topics[kind] = topic

    def _newest_of_all(self) -> int | None:
        """Return the newest stamp, ns, for which each topic has a row: base and arm of one tick."""
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
