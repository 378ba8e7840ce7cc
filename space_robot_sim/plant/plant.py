"""The plant: the robot in its environment, stepped tick by tick. Independent of ROS."""

from __future__ import annotations

import copy
import math
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot_model.elementary.matrices import direction_norm
from space_robot_model.robot import Robot
from space_robot_model.robot.momentum import Motion, robot_momentum
from space_robot_model.robot.placements import base_axes, cross, to_inertial
from space_robot_msgs_py import topics
from space_robot_msgs_py.compiled.records import RecordOwner, assign
from space_robot_msgs_py.errors import DivergedError, InputError
from space_robot_msgs_py.samples import MOST_WHEELS, Command, RobotState

from ..actuators.actuators import Actuators, check_faults, command_delay_buffer, reports_given
from ..component import ComponentFaults, Installation, kinds_of
from ..environment.captures import Captures
from ..environment.disturbance import LoadSchedule
from ..environment.environment import Environment, with_payload
from ..sensors.sensors import Sensors
from .mounting import check_springs, measured_motors, mount_gears, mount_wheels
from .settings import PlantSettings
from .tick import RATE_LIMIT, PlantMemory, measure, step, update_true_state

Array = NDArray[np.float64]
Block = NDArray[Any]


class PlantSnapshot(NamedTuple):
    """Saved state of a plant at a tick; made by `Plant.save`."""

    tick: int
    block: Block
    """Record of a `PlantMemory`."""
    command_delay_buffer: Array
    next_change: float
    faults: ComponentFaults
    misses: dict[float, float]
    """See `space_robot_sim.environment.captures.Captures`."""


class Plant(RecordOwner):
    """Plant that integrates the robot at a fixed period; a command is held over one tick.

    `truth` is the true state at the current tick, `state` what the sensors tell of it; `step`
    applies a command until the next one. Parts fail as ``settings.faults`` says. Momentum and
    energy follow from `truth` alone (`space_robot_model.robot.momentum`). A copy, also one by
    `pickle`, flies on to the same bits.
    """

    _views = ("truth", "state")

    def __init__(self, robot: Robot, settings: PlantSettings, period: float) -> None:
        """Place the robot at its start.

        Raises:
            InputError: initial configuration, actuators, sensors or faults do not fit the robot or
                period.
        """
        n = robot.n
        if len(settings.initial_joints_deg) != n:
            raise InputError(
                f"initial_joints_deg has {len(settings.initial_joints_deg)} values, "
                f"robot {robot.name!r} has {n} joints"
            )
        length = direction_norm(settings.initial_quaternion, "initial_quaternion")
        # only the settings of a node name their files
        settings.check(robot, getattr(settings, "actuators", "given"))
        self.names = settings.robot_names(robot)._replace(in_orbit=settings.has_orbit)
        """Names of all measured and commanded quantities."""
        robot = with_payload(robot, settings.payload)
        self.captures = Captures(settings.parsed_events, robot, period, settings)
        """Captures and releases of the flight."""
        self.period = period
        self.block = PlantMemory.block(n)
        """The plant's `PlantMemory`, for compiled loops."""
        memory = self.memory
        motors = measured_motors(robot) if robot.gears else ()
        at = Installation(
            n, period, memory.truth, robot, robot.is_prismatic[:n], motors, settings.fault_seed
        )
        assign(
            memory,
            model=robot.model,
            environment=Environment.build(settings, at),
            actuators=Actuators.build(settings, at),
            substeps=settings.substeps,
        )
        self.command_delay_buffer = command_delay_buffer(
            memory.actuators, len(self.names.commanded)
        )
        """Ring buffer of commands in transit."""
        memory.x[3:7] = np.array(settings.initial_quaternion) / length
        positions = np.concatenate(
            (robot.from_degrees(settings.initial_joints_deg), [s.rest for s in robot.springs])
        )
        memory.x[7 : 7 + robot.joint_count] = positions[list(robot.order)]
        turns = any(settings.initial_rate_deg_s)
        if turns:
            self._set_turning(robot, settings.initial_rate_deg_s, positions)
        speeds = memory.x[13 + 2 * robot.joint_count :][:MOST_WHEELS]
        if settings.wheel_count:
            mount_wheels(settings.wheels, memory.model, memory.environment.friction, speeds)
        if robot.gears:
            mount_gears(robot, memory.model, memory.environment.friction, memory.x)
            check_springs(robot, positions, period / settings.substeps, settings.substeps)
        self._bind_views()
        # as `write_truth` does for joints at rest, without loading compiled code
        self.truth.quaternion[:] = memory.x[3:7]
        self.truth.joint_positions[:] = positions[:n]
        self.truth.passive_positions[: len(robot.springs)] = positions[n:]
        self.truth.wheel_velocities[:] = speeds
        geared = [position for position, gear in zip(positions, robot.gears, strict=False) if gear]
        self.truth.motor_positions[: len(geared)] = geared
        orbit, model = memory.environment.orbit, memory.model
        first = 13 + 2 * robot.joint_count + int(model.wheel_count) + 2 * int(model.rotor_count)
        memory.x[first : first + 6] = *orbit.position, *orbit.velocity
        # captures load this kernel before the flight: no tick waits for it
        if turns or self.captures.exchanges or settings.has_orbit:
            update_true_state(self.block, 0, period)
        try:
            assign(memory, sensors=Sensors.build(settings, at))
        except InputError as error:
            file = getattr(settings, "sensors", "given")
            raise InputError(f"sensors {file}: {error}") from None
        schedule = settings.schedule(self.names, period)
        check_faults(schedule, settings)
        self._faults = ComponentFaults(schedule, PlantMemory)
        has_faults = {
            record: bool(schedule.of(*(kind.name for kind in kinds_of(record))))
            for record in (Sensors, Actuators)
        }
        self._loads = LoadSchedule.of(settings.disturbance, self.names.joints, period)
        if has_faults[Sensors]:  # else ideal sensors skip the kernels that faults change
            assign(memory.sensors, are_ideal=False)
        self.measures_truth = (
            bool(memory.sensors.are_ideal)
            and not any(motors)
            and reports_given(memory.actuators)
            and not has_faults[Actuators]
            and not settings.has_message_faults
        )
        """True if what comes of `state` can never differ from `truth`."""
        self.truth_topics = (
            *(() if self.measures_truth else topics.TRUTH),
            *((topics.TRUTH_ORBIT,) if settings.has_orbit else ()),
        )
        """Topics of what of the truth `state` does not tell."""
        self.next_change = math.inf
        """The first tick to come with an event, a begin or end of a fault, or loads that are due.

        It needs `begin_tick`: compiled code may fly up to there.
        """
        self.begin_tick(0)

    def _set_turning(self, robot: Robot, rate_deg_s: list[float], positions: Array) -> None:
        """Let the robot turn as one body about its centre of mass, which is at rest."""
        n, quaternion = robot.joint_count, self.memory.x[3:7]
        omega = np.radians(rate_deg_s)
        motion = Motion(*(row[np.newaxis] for row in (quaternion, omega, positions, 0 * positions)))
        # v0 = -omega x centre
        centre = robot_momentum(robot, motion).centre_of_mass
        turn = to_inertial(base_axes(quaternion[:, np.newaxis]), omega[:, np.newaxis])
        self.memory.x[7 + n : 10 + n] = cross(centre.T, turn)[:, 0]
        self.memory.x[10 + n : 13 + n] = turn[:, 0]

    def _bind_views(self) -> None:
        self.truth = RobotState(0, self.block["truth"])
        """The true state at the current tick."""
        self.state = RobotState(0, self.block["measured"])
        """Measured state at the current tick."""

    def __getstate__(self) -> dict[str, Any]:
        """Return all attributes but the views, and their state outside the block."""
        return {**super().__getstate__(), "_tick": self.tick}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore attributes and the tick."""
        PlantMemory.dtype(len(state["names"].joints))  # that compiled code knows the block's layout
        super().__setstate__({k: v for k, v in state.items() if k != "_tick"})
        self.state.tick = self.truth.tick = state["_tick"]

    def move_to(self, block: Block) -> None:
        """Keep the memory in another ``block`` from now on, beside that of other flights."""
        block[:] = self.block
        tick, self.block = self.tick, block
        self._bind_views()
        self.state.tick = self.truth.tick = tick

    @property
    def tick(self) -> int:
        """Ticks flown so far."""
        return self.state.tick

    @property
    def robot(self) -> Robot:
        """The robot as it flies now, with payload and what it holds."""
        return self.captures.robot_at(self.tick)

    @property
    def memory(self) -> PlantMemory:
        """The record in `block`; its numbers may be changed in flight."""
        record: PlantMemory = self.block[0]
        return record

    @property
    def saturated_ticks(self) -> int:
        """Ticks so far in which a torque was at its limit."""
        return int(self.memory.actuators.saturated_ticks)

    def step(self, command: Command) -> None:
        """Hold ``command`` (or the one due, if commands are delayed) over one tick.

        Raises:
            DivergedError: the state is no longer finite, or turns faster than `RATE_LIMIT`.
        """
        tick = self.state.tick
        goes_on = tick + 1 < self.next_change
        fastest = step(
            self.block, self.command_delay_buffer, command.torque, tick, self.period, goes_on
        )
        self.state.tick = self.truth.tick = tick + 1
        if not fastest <= RATE_LIMIT:
            raise self.diverged(fastest)
        if not goes_on:
            self.begin_tick(tick + 1)

    def begin_tick(self, tick: int) -> None:
        """Begin ``tick``, whose true state is known, and let the sensors measure it.

        Events happen; faults begin and end.
        """
        self.change(tick)
        if self.measures_truth and tick == 0:  # as `sense` does, without loading compiled code
            self.state.block[:] = self.truth.block
        else:
            measure(self.block, tick, self.period)

    def change(self, tick: int) -> None:
        """Let the events of ``tick`` happen, faults begin and end, and loads be known."""
        self.state.tick = self.truth.tick = tick
        memory = self.memory
        if self.captures.apply(tick, memory.model, memory.x):
            update_true_state(self.block, tick, self.period)
        self.next_change = min(
            self._faults.apply(tick, memory),
            self.captures.next_tick(tick),
            self._loads.apply(tick, memory.environment.loads),
        )

    def save(self) -> PlantSnapshot:
        """Copy all that the rest of the flight depends on, but the commands to come."""
        # faults keep the sound numbers of what they have changed
        return PlantSnapshot(
            self.tick,
            self.block.copy(),
            self.command_delay_buffer.copy(),
            self.next_change,
            copy.deepcopy(self._faults),
            dict(self.captures.misses),
        )

    def restore(self, snapshot: PlantSnapshot) -> None:
        """Go to the tick of a snapshot of this flight: from there the bits repeat."""
        self.block[:] = snapshot.block
        self.command_delay_buffer[:] = snapshot.command_delay_buffer
        self.state.tick = self.truth.tick = snapshot.tick
        self.next_change = snapshot.next_change
        self._faults = copy.deepcopy(snapshot.faults)
        self.captures.misses = dict(snapshot.misses)

    def diverged(self, fastest: float) -> DivergedError:
        """Return the error for a fastest rate after a step of ``fastest``, rad/s."""
        why = "the state is not finite" if np.isnan(fastest) else f"{fastest:.3g} rad/s"
        return DivergedError(self.tick, self.period, why)
