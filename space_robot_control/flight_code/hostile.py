"""Hostile states and references: what no sensor and no mission should ever send.

The flight code has to answer all the same.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Reference, RobotState

from ..navigation.attitude_filter import multiply

Array = NDArray[np.float64]

VALUES = (
    *(np.nan, -np.nan, np.inf, -np.inf, 0.0, -0.0, 5e-324, -5e-324, 2.2e-308, 1e-160, 1e-6),
    *(1.0, -1.0, 1e15, -1e15, 1e29, 1.1e30, -1e31, 1e154, 1e200, 1.7e308, -1.7e308),
)
JUMPS = (0, -1, -2, 2, 7, 20, 21, 500, 1999, 2001, -5000, 10**6, 10**12, 2**52, -(2**62), 2**62)
LEAST, MOST = -(2**63), 2**63 - 1
SHARE, REFERENCE_SHARE = 0.3, 0.1
"""Shares of the states, and of their references, that are hostile."""


def shake(state: RobotState, size: float, random: np.random.Generator) -> None:
    """Add noise of a ``size`` to all numbers of a state; its quaternion stays unit."""
    state.numbers[:] += size * random.normal(size=state.numbers.size)
    state.quaternion[:] /= np.sqrt(state.quaternion @ state.quaternion)


def spoil(
    state: RobotState,
    wheels: int,
    random: np.random.Generator,
    desired: Array,
    is_hostile: bool = True,
) -> None:
    """Change some numbers of a state; those of wheels that the base does not have become zero.

    ``desired`` (4,) is the quaternion that the reference of the state has, or should have.
    """
    numbers = state.numbers
    way = random.integers(6) if is_hostile else -1
    if way == 0:  # any numbers
        places = random.integers(numbers.size, size=random.integers(1, 4))
        numbers[places] = random.choice(VALUES, size=places.size)
    elif way == 1:  # an attitude near half a turn from the desired one, or beyond
        eta = random.choice([0.0, 1e-7, 0.01, 0.0199, 0.03, -0.04, 0.06])
        axis = random.normal(size=3)
        axis *= np.sqrt(1.0 - eta * eta) / np.sqrt(axis @ axis)
        multiply(desired, np.array([eta, *axis]), state.quaternion)
    elif way == 2:  # a quaternion of another norm
        state.quaternion[:] *= random.choice([0.0, 0.9, 0.9996, 1.0004, 1.1, -1.0])
    elif way == 3:  # everything the same number
        numbers[:] = random.choice(VALUES)
    elif way == 4:  # half a turn from what was, exactly, or the same with the other sign
        w, x, y, z = state.quaternion.copy()
        state.quaternion[:] = random.choice([[-w, -x, -y, -z], [-x, w, -z, y]])
    elif way == 5:  # large but allowed
        numbers[:] *= 10.0 ** random.integers(0, 20)
        state.quaternion[:] = [1.0, 0.0, 0.0, 0.0]
    state.wheel_velocities[wheels:] = state.wheel_torques[wheels:] = 0.0


def spoiled_reference(reference: Block, random: np.random.Generator) -> Block:
    """Return a reference with some, or all, of its numbers changed."""
    spoiled = reference.copy()
    for part in Reference.parts(spoiled):
        numbers = part.reshape(-1)
        places = random.integers(numbers.size, size=random.choice([0, 1, 3, numbers.size]))
        numbers[places] = random.choice(VALUES, size=places.size)
    return spoiled


def hostile_ticks(count: int, random: np.random.Generator) -> Iterator[int]:
    """Return ticks of states, most of them one after the other."""
    tick = 10**6
    for _ in range(count):
        yield tick if random.random() > 0.02 else int(random.choice([LEAST, MOST, -1, 2**52 + 1]))
        step = int(random.choice(JUMPS)) if random.random() < 0.05 else 1
        tick = min(max(tick + step, LEAST), MOST)
        if not 0 <= tick <= 2**52 and random.random() < 0.5:
            tick = int(random.integers(10**6))
