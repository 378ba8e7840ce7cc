"""Settings of the task "reach", and its episodes: a start and a target for each."""

from __future__ import annotations

from collections.abc import Mapping
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.config.arguments import as_numbers, as_positive, as_whole_number
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import update_true_state

from ..flight.compilation import compile_kernels
from ..flight.plan import Flight
from ..scenario.scenario import Scenario

Array = NDArray[np.float64]


class Episode(NamedTuple):
    """What a reset draws."""

    start: Array
    """(n,) joint positions, rad or m."""
    target: Array
    """(n,) joint positions to be reached."""


class ReachTask:
    """The robot, its start and the numbers of the task, common to all environments."""

    def __init__(
        self,
        scenario: Scenario | None = None,
        ticks_per_step: int = 1,
        duration: float = 2.0,
        torque_scale: ArrayLike = 10.0,
        start_spread: float = 0.3,
        reach: float = 0.5,
    ) -> None:
        """Check the settings.

        Args:
            scenario: robot, case (friction, disturbances) and period; None: the paper's.
            ticks_per_step: ticks for which an action is held.
            duration: of an episode, s.
            torque_scale: torque, N m (prismatic joints: N), of an action of 1; scalar or (m,).
            start_spread: largest distance of a start from the scenario's, rad or m, each joint.
            reach: largest distance of a target from its start, rad or m, each joint.

        Raises:
            InputError: a number is out of its range, or the scenario has what the task has not:
                an orbit, joints with gears, sensors with errors, delays, faults, events, or a base
                with hardware.
        """
        scenario = Scenario(controller=None) if scenario is None else scenario
        if not isinstance(scenario, Scenario):
            raise InputError(f"scenario: a Scenario was expected, got {short(scenario)}")
        self.scenario = scenario.replace(controller=None)
        self.flight = self.scenario.check()
        _check_simple(self.flight)
        n = self.flight.robot.n
        self.n, self.period = n, self.flight.period
        self.ticks_per_step = as_whole_number(ticks_per_step, "ticks_per_step", 1)
        seconds = as_positive(duration, "duration")
        steps = max(1, round(seconds / (self.period * self.ticks_per_step)))
        self.ticks = steps * self.ticks_per_step
        """Length of an episode: whole steps."""
        scale = as_numbers(torque_scale, "torque_scale")
        if scale.shape not in ((), (n + 3,)) or not np.all((scale > 0.0) & np.isfinite(scale)):
            raise InputError(f"torque_scale: 1 or {n + 3} numbers above 0 are allowed, got {scale}")
        self.scale = np.broadcast_to(scale, (n + 3,))
        self.start_spread = _not_negative(start_spread, "start_spread")
        self.reach = _not_negative(reach, "reach")
        self.begin = Plant(self.flight.robot, self.flight.plant_settings, self.period)
        """A plant at tick 0."""
        self.state_size = 13 + 2 * self.flight.robot.joint_count
        """Numbers of a state vector, see `space_robot_sim.plant.integrator.Stages`."""
        compile_kernels()

    def episode(self, generator: np.random.Generator) -> Episode:
        """Draw an episode."""
        about = self.begin.truth.joint_positions
        start = about + self.start_spread * generator.uniform(-1.0, 1.0, self.n)
        return Episode(start, start + self.reach * generator.uniform(-1.0, 1.0, self.n))

    def put(self, episode: Episode, plant: Block, reach: Block) -> None:
        """Write the begin of an episode into blocks (1,) of `PlantMemory` and `Reach`."""
        plant[:] = self.begin.block
        rows = 7 + self.begin.memory.model.row[: self.n].astype(int)
        plant["x"][0, rows] = episode.start
        update_true_state(plant, 0, self.period)
        reach["target"], reach["scale"] = episode.target, self.scale
        reach["attitude"] = self.begin.truth.quaternion
        reach["tick"], reach["ticks"], reach["has_failed"] = 0.0, self.ticks, 0.0


def reach_task(settings: Mapping[str, Any]) -> ReachTask:
    """Return the task with some settings by name.

    Raises:
        InputError: a name is unknown; see `ReachTask`.
    """
    for name in settings:
        one_of(name, signature(ReachTask).parameters, "setting", " of the task reach")
    return ReachTask(**settings)


def _not_negative(value: float, name: str) -> float:
    number = as_numbers(value, name)
    if number.shape or not 0.0 <= number < np.inf:
        raise InputError(f"{name}: a number 0 or more was expected, got {value!r}")
    return float(number)


def _check_simple(flight: Flight) -> None:
    plant, why = flight.plant, ""
    if plant.names.actuators or not flight.controls_base:
        why = "a base without ideal torques"
    elif plant.names.in_orbit:
        why = "an orbit"
    elif any(flight.robot.gears):
        why = "joints with gears"
    elif not plant.measures_truth:
        why = "sensors, drives or faults with errors"
    elif plant.command_delay_buffer.size:
        why = "delayed commands"
    elif np.isfinite(plant.next_change):
        why = "faults or events"
    elif flight.plant_settings.disturbance.table:
        why = "a disturbance of your own"
    if why:
        raise InputError(f"scenario: {why}: the task reach has none; see SpaceRobotEnv")
