"""The task "reach" as environments of Gymnasium: one, or many in lanes.

env = gymnasium.make("space_robot/Reach-v0")
envs = space_robot.make_vec("reach", num_envs=64)
"""

from __future__ import annotations

import os
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from inspect import signature
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.config.arguments import as_numbers, as_positive, as_whole_number
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import PlantMemory

try:
    import gymnasium
    from gymnasium.spaces import Box
    from gymnasium.vector import AutoresetMode, VectorEnv
    from gymnasium.vector.utils import batch_space
except ImportError:
    raise ImportError(f"gymnasium is not installed: {install_command('gym')}") from None

from ..api import Scenario
from ..flight.compilation import compile_kernels
from ..flight.lane_loop import InLanes
from ..flight.lane_memory import in_lanes, record_numbers
from ..flight.plan import Flight
from .reach import LARGEST, Reach, begin_episode, step_alone, step_in_lanes

Info = dict[str, Any]

MOST_ENVS, MOST_THREADS = 1 << 18, 1024
"""Largest numbers of environments, which take 4 KB each, and of threads."""
TASKS: dict[str, dict[str, Any]] = {"reach": {}, "point": {"boresight": (0.0, 0.0, 1.0)}}
"""The tasks, by their settings of `ReachTask`."""
NAME, POINT_NAME = "space_robot/Reach-v0", "space_robot/Point-v0"
"""Names for `gymnasium.make` and `gymnasium.make_vec`, registered with this module."""


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
        boresight: ArrayLike | None = None,
    ) -> None:
        """Check the settings.

        Args:
            scenario: robot, case and period; None: the paper's.
            ticks_per_step: ticks for which an action is held.
            duration: of an episode, s.
            torque_scale: torque, N m (prismatic joints: N), of an action of 1; scalar or (m,).
            start_spread: largest distance of a start from the scenario's, rad or m, each joint.
            reach: largest distance of a target from its start, rad or m, each joint.
            boresight: direction on the base's axes that is to be kept; the base may turn about it.
                None: the whole attitude is.

        Raises:
            InputError: a number is out of its range, or the scenario has what the task has not, as
                an orbit, gears, sensors with errors, delays, faults, or a base with hardware.
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
        self.boresight = np.zeros(3)
        if boresight is not None:
            axis = as_numbers(boresight, "boresight")
            if axis.shape != (3,) or not 0.0 < (length := float(np.linalg.norm(axis))) < np.inf:
                raise InputError(f"boresight: three numbers, not all 0, were expected, got {axis}")
            self.boresight = axis / length
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
        """Begin an episode in blocks (1,) of `PlantMemory` and `Reach`."""
        plant[:] = self.begin.block
        reach["start"], reach["target"] = episode
        self.describe(reach)
        begin_episode(plant, reach, self.period)

    def describe(self, reach: Block) -> None:
        """Write what all episodes have in common."""
        reach["scale"], reach["ticks"], reach["boresight"] = self.scale, self.ticks, self.boresight


def _task(settings: Mapping[str, Any]) -> ReachTask:
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


class ReachEnv(gymnasium.Env[Array, Array]):
    """An arm that is to reach postures while its base keeps its attitude; m = n+3 axes.

    - Reset: joints at rest at a random start, and a random target for them.
    - Observation (2 m,): errors of the base's attitude (vector part of the rotation) and of the
      joints, rad (or m); angular velocity of the base in its frame and joint rates, rad/s.
    - Action (m,): torque divided by ``torque_scale``, held over ``ticks_per_step`` ticks.
    - Reward: -cost dt with the cost per second
      ``4 |e_eps|^2 + |e_theta|^2 + 0.1 |omega, thetadot|^2 + 0.001 |action|^2``. With a
      ``boresight`` e_eps is the part across it.
    - Terminated: the cost is 100 or more, or the flight has diverged; what is left of the episode
      then costs 100 per second. Truncated: after ``duration``.
    """

    def __init__(self, **settings: Any) -> None:
        """Create an environment; ``settings`` are those of `ReachTask`."""
        self.task = _task(settings)
        self.observation_space, self.action_space = _spaces(self.task)
        self._plant, self._reach = self.task.begin.block.copy(), Reach.block(self.task.n)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[Array, Info]:
        """Start an episode; ``options`` is not used."""
        super().reset(seed=seed)
        self.task.put(self.task.episode(self.np_random), self._plant, self._reach)
        return self._reach["observation"][0].copy(), {}

    def step(self, action: Array) -> tuple[Array, float, bool, bool, Info]:
        """Apply an action; an `InputError` if it has not m numbers, or the episode is over."""
        reach, task = self._reach, self.task
        if not reach["ticks"][0] or reach["has_failed"][0] or reach["tick"][0] >= task.ticks:
            raise InputError("the episode is over, or has not begun: reset the environment")
        reach["action"] = _checked(action, (task.n + 3,))
        buffer = task.begin.command_delay_buffer
        step_alone(self._plant, buffer, reach, task.ticks_per_step, task.period)
        failed = bool(reach["has_failed"][0])
        truncated = not failed and bool(reach["tick"][0] >= task.ticks)
        return reach["observation"][0].copy(), float(reach["reward"][0]), failed, truncated, {}


class ReachEnvs(VectorEnv[Any, Any, Any]):
    """Many `ReachEnv` stepped together: what those here and those on a device have in common."""

    def __init__(self, num_envs: int, most: int, settings: Mapping[str, Any]) -> None:
        """Check number, at most ``most``, and settings, and describe the spaces."""
        self.num_envs = as_whole_number(num_envs, "num_envs", 1, most)
        self.task = _task(settings)
        self.single_observation_space, self.single_action_space = _spaces(self.task)
        self.observation_space = batch_space(self.single_observation_space, self.num_envs)
        self.action_space = batch_space(self.single_action_space, self.num_envs)
        self.metadata = {"autoreset_mode": AutoresetMode.NEXT_STEP}


class ReachVectorEnv(ReachEnvs):
    """Many `ReachEnv` stepped together, eight in the lanes of a vector; each with its own bits.

    An environment whose episode is over begins the next one at the following step, which ignores
    its action (`AutoresetMode.NEXT_STEP`).
    """

    def __init__(self, num_envs: int = WIDTH, threads: int = 1, **settings: Any) -> None:
        """Create the environments.

        Args:
            num_envs: number of environments; a multiple of 8 fills all lanes.
            threads: among which they are divided; the bits do not depend on it.
            settings: of `ReachTask`.
        """
        super().__init__(num_envs, MOST_ENVS, settings)
        task = self.task
        groups = -(-self.num_envs // WIDTH)
        self._states = np.zeros((groups, task.state_size, WIDTH))
        self._reaches: Block = np.zeros(groups, Reach.dtype(task.n, WIDTH))
        self._buffer = np.zeros((*task.begin.command_delay_buffer.shape, WIDTH))
        self._begin = task.begin.block.copy(), Reach.block(task.n)
        self._actions = np.zeros((groups * WIDTH, task.n + 3))
        self._results = np.ones((3, groups, WIDTH))
        self._observations = np.zeros((groups * WIDTH, 2 * (task.n + 3)))
        self._over = np.zeros(self.num_envs, np.bool_)
        """Environments that begin a new episode at the next step."""
        self._generators: list[np.random.Generator] = []
        parts = np.array_split(
            np.arange(groups), as_whole_number(threads, "threads", 1, MOST_THREADS)
        )
        self._parts = [slice(int(part[0]), int(part[-1]) + 1) for part in parts if len(part)]
        self._work = [_motor_work(task.begin) for _ in self._parts]
        self._pool: ThreadPoolExecutor | None = None
        self._pool_process = 0
        """Of the pool's threads: a forked process has none of them."""

    def reset(
        self,
        *,
        seed: int | Sequence[int | None] | None = None,
        options: dict[str, Any] | None = None,
    ) -> tuple[Array, Info]:
        """Start an episode of each environment; ``options`` is not used.

        ``seed``: of the first; the next ones have the numbers after it. Or one for each.
        """
        count = self.num_envs
        if seed is not None or not self._generators:
            seeds: list[int | None] = [None] * count
            if isinstance(seed, Sequence) and not isinstance(seed, str):
                if len(seed) != count:
                    raise InputError(f"seed: {count} numbers were expected, got {len(seed)}")
                seeds = [
                    None if own is None else as_whole_number(own, f"seed[{k}]", 0)
                    for k, own in enumerate(seed)
                ]
            elif seed is not None:
                first = as_whole_number(seed, "seed", 0)
                seeds = [first + k for k in range(count)]
            self._generators = [gymnasium.utils.seeding.np_random(own)[0] for own in seeds]
        self._start(range(self.num_envs))
        return self._observations[: self.num_envs].copy(), {}

    def step(self, actions: Array) -> tuple[Array, Array, Array, Array, Info]:
        """Apply an action (num_envs, m) of each environment."""
        if not self._generators:
            raise InputError("reset the environments before the first step")
        count = self.num_envs
        self._actions[:count] = _checked(actions, (count, self.task.n + 3))
        over = np.flatnonzero(self._over)
        results = self._results.reshape(3, -1)
        results[2, :count] = self._over
        if len(self._parts) > 1:
            list(self._threads().map(self._step_part, range(len(self._parts))))
        else:
            self._step_part(0)
        if len(over):
            self._start(over)
            results[:, over] = 0.0
        rewards, failed, truncated = results[:, :count].copy()
        self._over = (failed + truncated) > 0.0
        return self._observations[:count].copy(), rewards, failed > 0.0, truncated > 0.0, {}

    def _threads(self) -> ThreadPoolExecutor:
        if self._pool is None or self._pool_process != os.getpid():
            self._pool, self._pool_process = ThreadPoolExecutor(len(self._parts)), os.getpid()
        return self._pool

    def close_extras(self, **kwargs: Any) -> None:
        """End the threads."""
        if self._pool and self._pool_process == os.getpid():
            self._pool.shutdown()

    def _step_part(self, number: int) -> None:
        task, part, work = self.task, self._parts[number], self._work[number]
        rows = slice(WIDTH * part.start, WIDTH * part.stop)
        results = self._results[:, part]
        if results.shape != self._results.shape:  # kernels want contiguous lanes
            results = results.copy()
        step_in_lanes(
            work.block,
            work.alone,
            self._buffer,
            self._states[part],
            self._reaches[part],
            self._actions[rows],
            results,
            self._observations[rows],
            task.ticks_per_step,
            task.period,
        )
        self._results[:, part] = results

    def _start(self, numbers: Any) -> None:
        plant, reach = self._begin
        for k in numbers:
            self.task.put(self.task.episode(self._generators[k]), plant, reach)
            group, lane = divmod(int(k), WIDTH)
            self._states[group, :, lane] = plant["x"][0, : self._states.shape[1]]
            record_numbers(self._reaches[group : group + 1])[:, lane] = reach.view(np.float64)
            self._observations[k] = reach["observation"][0]


def _spaces(task: ReachTask) -> tuple[Any, Any]:
    m = task.n + 3
    high = np.full(2 * m, LARGEST)
    high[:3] = 2.0
    return Box(-high, high, dtype=np.float64), Box(-1.0, 1.0, (m,), np.float64)


def _checked(action: Any, shape: tuple[int, ...]) -> Array:
    numbers = as_numbers(action, "action")
    if numbers.shape != shape:
        raise InputError(
            f"action: an array of shape {shape} was expected, got one of shape {numbers.shape}"
        )
    return numbers


def _motor_work(plant: Plant) -> InLanes:
    records = in_lanes(PlantMemory, len(plant.names.joints))
    records.alone[:] = plant.block
    records.numbers[:] = records.numbers_alone.T
    return records


for _name, _settings in zip((NAME, POINT_NAME), TASKS.values(), strict=True):
    if _name not in gymnasium.registry:
        gymnasium.register(
            _name,
            f"{__name__}:{ReachEnv.__name__}",
            kwargs=_settings,
            vector_entry_point=f"{__name__}:{ReachVectorEnv.__name__}",
        )
