"""The task "reach": bring the arm from one posture to another while the base keeps its attitude.

Its kernels are compiled for one environment and for eight in lanes, with the same bits.
"""

from __future__ import annotations

import numpy as np

from space_robot_model.dynamics.attitude import attitude_error_into
from space_robot_model.elementary.matrices import Array
from space_robot_model.elementary.normal import State as RandomState
from space_robot_model.elementary.normal import following, unit_of
from space_robot_msgs_py.compiled.kernels import kernel
from space_robot_msgs_py.compiled.lanes import WIDTH, as_lanes, where, whole, with_lane
from space_robot_msgs_py.compiled.records import Block, Record, shaped
from space_robot_msgs_py.samples import State
from space_robot_sim.plant.lanes import move_lanes, spread
from space_robot_sim.plant.tick import (
    RATE_LIMIT,
    advance,
    begin_interval,
    end_interval,
    write_true_state,
)

WORST_COST = 100.0
"""Cost per second that terminates an episode: that of a joint error of 10 rad."""
RATE_WEIGHT, ACTION_WEIGHT = 0.1, 1e-3
"""Weights of squared rates, rad2/s2, and squared actions in the cost per second; the weight of
squared errors, rad2, is 1, of the attitude's (half the angle) 4."""
LARGEST = 1e4
"""Limit of the absolute values of an observation; larger ones are clipped."""


class Reach(Record):
    """An episode of the task."""

    start: Array = shaped(lambda n: (n,))
    """Joint positions at the beginning, rad or m."""
    target: Array = shaped(lambda n: (n,))
    """Joint positions to be reached, rad or m."""
    attitude: Array = shaped(lambda n: (4,))
    """Attitude to be kept, unit quaternion."""
    boresight: Array = shaped(lambda n: (3,))
    """Direction on the base's axes, about which a turn costs nothing; zero: there is none."""
    scale: Array = shaped(lambda n: (n + 3,))
    """Torque of an action of 1, N m or N."""
    attitude_error: Array = shaped(lambda n: (4,))
    """Rotation from there to the attitude."""
    action: Array = shaped(lambda n: (n + 3,))
    """Of the present step."""
    torque: Array = shaped(lambda n: (n + 3,))
    """Scratch: the command, N m or N."""
    tick: float = shaped(lambda n: ())
    """Ticks of the episode so far."""
    ticks: float = shaped(lambda n: ())
    """Length of the episode."""
    observation: Array = shaped(lambda n: (2 * n + 6,))
    """Errors of attitude (vector part of the rotation) and joints, angular velocity of the base,
    joint rates."""
    reward: float = shaped(lambda n: ())
    """Of the last step."""
    has_failed: float = shaped(lambda n: ())
    """1 once the cost is `WORST_COST` or the flight has diverged."""


@kernel
def observe(reach: Reach, truth: State) -> None:
    """Write the observation of a state."""
    n, out, error = reach.target.size, reach.observation, reach.attitude_error
    attitude_error_into(reach.attitude, truth.quaternion, error)
    side = where(error[0] >= 0.0, -1.0, 1.0)
    for i in range(3):
        out[i] = side * error[1 + i]
        out[3 + n + i] = truth.omega_base[i]
    for i in range(n):
        out[3 + i] = reach.target[i] - truth.joint_positions[i]
        out[6 + n + i] = truth.joint_velocities[i]
    for i in range(out.size):
        known = where(np.isnan(out[i]), 0.0, out[i])
        out[i] = min(max(known, -LARGEST), LARGEST)


@kernel
def judge(reach: Reach, truth: State, fastest: float, ticks: int, period: float) -> None:
    """Write observation, reward and failure after a step of ``ticks`` ticks.

    What is left of a failed episode costs `WORST_COST` a second: an early end is no advantage.
    """
    observe(reach, truth)
    n, out, axis = reach.target.size, reach.observation, reach.boresight
    cost, along = 0.0, out[0] * axis[0] + out[1] * axis[1] + out[2] * axis[2]
    for i in range(3):
        across = out[i] - along * axis[i]
        cost += 4.0 * across * across + RATE_WEIGHT * out[3 + n + i] * out[3 + n + i]
    for i in range(n):
        cost += out[3 + i] * out[3 + i] + RATE_WEIGHT * out[6 + n + i] * out[6 + n + i]
    for i in range(n + 3):
        cost += ACTION_WEIGHT * reach.action[i] * reach.action[i]
    is_good = (fastest <= RATE_LIMIT) & (cost < WORST_COST)
    charged = where(is_good, ticks * 1.0, reach.ticks - reach.tick)
    reach.reward = -where(is_good, cost, WORST_COST) * charged * period
    reach.has_failed = where(is_good, 0.0, 1.0)
    reach.tick = reach.tick + ticks


@kernel
def step_alone(
    plant: Block, command_delay_buffer: Array, reach: Block, ticks: int, period: float
) -> None:
    """Apply the action of one environment for some ticks."""
    memory, task, fastest = plant[0], reach[0], 0.0
    for i in range(task.torque.size):
        task.torque[i] = task.scale[i] * task.action[i]
    for k in range(ticks):
        if fastest <= RATE_LIMIT:
            tick = int(task.tick) + k
            fastest = advance(memory, command_delay_buffer, task.torque, tick, period)
    judge(task, memory.truth, fastest, ticks, period)


@kernel
def begin_episode(plant: Block, reach: Block, period: float) -> None:
    """Put a plant that stands at tick 0 at the start of an episode, and write what is observed."""
    memory, task = plant[0], reach[0]
    for i in range(task.start.size):
        memory.x[7 + whole(memory.model.row[i])] = task.start[i]
    write_true_state(memory, 0, period)
    task.attitude[:] = memory.truth.quaternion
    task.tick, task.has_failed = 0.0, 0.0
    observe(task, memory.truth)


@kernel
def draw_episode(
    random: RandomState, plant: Block, reach: Block, spread: float, distance: float
) -> RandomState:
    """Draw an episode as `reach_env.ReachTask.episode` does, about the plant's joint positions.

    ``random`` is the state of a generator; that after the draws is returned.
    """
    about, task = plant[0].truth.joint_positions, reach[0]
    for i in range(task.start.size):
        random = following(random)
        task.start[i] = about[i] + spread * (2.0 * unit_of(random) - 1.0)
    for i in range(task.start.size):
        random = following(random)
        task.target[i] = task.start[i] + distance * (2.0 * unit_of(random) - 1.0)
    return random


@kernel
def step_in_lanes(
    work: Block,
    alone: Block,
    command_delay_buffer: Array,
    states: Array,
    reaches: Block,
    actions: Array,
    results: Array,
    observations: Array,
    ticks: int,
    period: float,
) -> None:
    """Apply the actions of E environments in lanes for some ticks; each has its own time.

    Args:
        work: (1,) block of `PlantMemory` in lanes, at tick 0. Groups of eight take turns in it:
            commands are not delayed and drives are exact, so only their states remain.
        alone: (8,) block of the same.
        command_delay_buffer: (0, m, 8).
        states: (groups, numbers, 8) state vectors.
        reaches: `Reach` of the groups, in lanes.
        actions: (E, m).
        results: (3, groups, 8): rewards; 1 for episodes that have failed; 1 for those whose time is
            over. Before, 1 in the last one is for an environment that is left as it is.
        observations: (E, 2 m), written.
        ticks: of the step.
        period: s.
    """
    buffer, out = as_lanes(command_delay_buffer), as_lanes(results)
    memory, all_states = work[0], as_lanes(states)
    for group in range(reaches.size):
        task, flies, state = reaches[group], out[2, group] == 0.0, all_states[group]
        first, fastest = WIDTH * group, 0.0 * task.tick
        for i in range(state.size):
            memory.x[i] = state[i]
        for i in range(task.torque.size):
            action = task.action[i]
            for lane in range(WIDTH):
                action = with_lane(action, lane, actions[first + lane, i])
            task.action[i] = action
            task.torque[i] = task.scale[i] * action
        for k in range(ticks):
            flies = flies & (fastest <= RATE_LIMIT)
            begin_interval(memory, buffer, task.torque, 0, period)
            move_lanes(memory, alone, (task.tick + k) * period, period, flies)
            fastest = where(flies, end_interval(memory, 0, period), fastest)
        for i in range(state.size):
            state[i] = memory.x[i]
        judge(task, memory.truth, fastest, ticks, period)
        out[0, group], out[1, group] = task.reward, task.has_failed
        out[2, group] = where((task.tick >= task.ticks) & (task.has_failed == 0.0), 1.0, 0.0)
        spread(task.observation, observations[first : first + WIDTH])
