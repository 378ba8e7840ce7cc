"""Stability of a law on a robot with gears, along a mission.

The laws believe that a joint turns as its motor does. With springs between them the loop of
`closed_loop` is closed over the motions of `space_robot_model.robot.gears.FlexibleModel`, of which
the momentum of what floats freely is eliminated. Switching terms are left out, a boundary layer
counts with its slope. An absolute eigenvalue above 1 says by how much an oscillation grows in a
tick. Modes slower than half of the slowest spring are those of the rigid robot, which the switching
terms decide; they do not count.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from space_robot_control.laws import ControlLaw
from space_robot_control.laws.base import NO_ESTIMATE
from space_robot_control.navigation.rate_filters import low_pass_weight
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.gears import FlexibleModel, flexible_model, geared_joints

from .closed_loop import SLOWEST_GROWTH, SmallMotion, bisect, linear_loop
from .inertia import J0, Posture, inertia_in_rho, postures_at
from .linear_law import LinearLaw, linear_laws

RIGID = 0.5
"""Share of the slowest spring's rate below which a mode is one of the rigid robot."""
LOWEST_HZ = 0.01
"""Lowest corner of a low-pass that is tried."""
FACTORS = (1e-3, 1e3)
"""Factors on the assumed inertia between which its limit is searched."""


@dataclass(frozen=True)
class FlexibleCheck:
    """Stability of a law on a robot with gears, along a mission."""

    radius: float
    """Largest absolute eigenvalue of all configurations; 0: there is none that counts."""
    largest_corner_hz: float | None
    """Largest corner of ``acceleration_filter_hz`` with which the law is stable: the bandwidth that
    its estimate may have. 0: none helps; None: none is needed, or the law has no estimate."""
    largest_h_bar_scale: float | None
    """Largest factor on the inertia that the law's estimate or observer assumes, of all axes, with
    which the law is stable; None: neither."""

    @property
    def is_stable(self) -> bool:
        """True if no small oscillation grows."""
        return self.radius <= 1.0 + SLOWEST_GROWTH


def joint_frequencies(robot: Robot, joint_positions: Array) -> Array:
    """Return the frequency of each of G gears' springs, the others rigid, (K, G) Hz.

    The base floats freely and no motor is held: of one joint on a fixed base it is that of the
    two-mass oscillator, ``sqrt(K (1 / B + 1 / I)) / 2 pi``.

    Args:
        robot: with gears.
        joint_positions: (K, N) of all joints, rad or m.
    """
    joints, size = geared_joints(robot), 6 + robot.joint_count
    frequencies = np.zeros((len(joint_positions), len(joints)))
    for row, positions in enumerate(joint_positions):
        model = flexible_model(robot, positions)
        for k, joint in enumerate(joints):
            merged = np.zeros((size + len(joints), size + 1))
            merged[:size, :size] = np.eye(size)
            for other, moved in enumerate(joints):
                merged[size + other, size if other == k else 6 + moved] = 1.0
            compliance = np.linalg.inv(merged.T @ model.inertia @ merged)
            spring = np.zeros(size + 1)
            spring[6 + joint], spring[size] = 1.0, -1.0
            gear = robot.gears[joint]
            assert gear
            square = gear.stiffness * float(spring @ compliance @ spring)
            frequencies[row, k] = np.sqrt(square) / (2.0 * np.pi)
    return frequencies


def fast_inertia(robot: Robot, joint_positions: Array) -> Array:
    """Return H_S (K, m, m) within a tick, when motors move without the links behind their gears.

    Args:
        robot: with gears.
        joint_positions: (K, n) of the actuated joints, rad or m.
    """
    rest = [spring.rest for spring in robot.springs]
    motors = {joint: 6 + robot.joint_count + k for k, joint in enumerate(geared_joints(robot))}
    axes = [3, 4, 5, *(motors.get(joint, 6 + joint) for joint in range(robot.n))]
    models = [flexible_model(robot, np.array([*row, *rest])) for row in joint_positions]
    inertia = np.array([_reduced(model, np.array(axes)).inertia for model in models])
    return inertia_in_rho(inertia)


class FlexibleMotions:
    """Small motions of a robot with gears along a mission, whatever law controls it."""

    def __init__(
        self, robot: Robot, joint_positions: Array, period: float, controls_base: bool
    ) -> None:
        """Linearise the robot.

        Args:
            robot: with gears.
            joint_positions: (K, n) of the actuated joints in all configurations, rad or m.
            period: of a tick, s.
            controls_base: whether the base has attitude actuators.
        """
        rest = np.tile([spring.rest for spring in robot.springs], (len(joint_positions), 1))
        positions = np.hstack([joint_positions, rest])
        self.frequencies = joint_frequencies(robot, positions)
        """(K, G) Hz, see `joint_frequencies`."""
        self.period = period
        self.postures = postures_at(robot, joint_positions, controls_base)
        """Of all configurations, without springs."""
        jacobian = np.eye(self.postures[0].axes)
        if controls_base:
            jacobian[:3, :3] *= J0
        self.configurations = [
            _motion(robot, row, jacobian, posture, period)
            for row, posture in zip(positions, self.postures, strict=True)
        ]
        """Motions in each configuration."""


def check_flexible(law: ControlLaw, motions: FlexibleMotions, corner_hz: float) -> FlexibleCheck:
    """Check the stability of a law on a robot with gears.

    Args:
        law: with its gains, and the period of ``motions``.
        motions: of the robot.
        corner_hz: of the low-pass of the time-delay pair, Hz (0: none).
    """
    least = RIGID * 2.0 * np.pi * float(motions.frequencies.min())
    period = motions.period
    laws = linear_laws(law, motions.postures)

    def radii(corner: float, laws: Iterable[LinearLaw]) -> Iterator[float]:
        weight = low_pass_weight(corner, period) or 1.0
        for motion, linear in zip(motions.configurations, laws, strict=True):
            yield _fast_growth(linear_loop(motion, linear, weight).step, period, least)

    def is_stable(corner: float, laws: Iterable[LinearLaw]) -> bool:
        return all(radius <= 1.0 + SLOWEST_GROWTH for radius in radii(corner, laws))

    radius = max(radii(corner_hz, laws))
    if law.uses_model or not (laws[0].uses("n_hat") or laws[0].uses("applied_force")):
        return FlexibleCheck(radius, None, None)
    corner: float | None = None
    if law.estimate != NO_ESTIMATE and not is_stable(0.0, laws):
        corner = _largest(LOWEST_HZ, 0.5 / period, lambda value: is_stable(value, laws))
    scale = _largest(
        *FACTORS, lambda x: is_stable(corner_hz, linear_laws(law, motions.postures, x))
    )
    return FlexibleCheck(radius, corner, scale)


def _largest(low: float, high: float, is_stable: Callable[[float], bool]) -> float:
    """Return the largest value that is stable, to a thousandth; 0: none is."""
    if not is_stable(low):
        return 0.0
    if is_stable(high):
        return high
    return math.exp(bisect(math.log(low), math.log(high), lambda x: is_stable(math.exp(x))))


def _motion(
    robot: Robot, positions: Array, jacobian: Array, posture: Posture, period: float
) -> SmallMotion:
    """Return the motions near a configuration.

    Args:
        robot: with gears.
        positions: (N,) of all joints, rad or m.
        jacobian: (m, m) rates in rho by those of base and joints.
        posture: of the rigid robot in this configuration.
        period: s.
    """
    model, base = flexible_model(robot, positions), len(jacobian) - robot.n
    rows = np.arange(3 if base else 6, len(model.inertia))
    force, rate = _axis_maps(robot, len(model.inertia), base)
    step, by_force = _discrete(_reduced(model, rows), force[rows] @ jacobian.T, period)
    return SmallMotion(step, by_force, jacobian @ rate[:, rows], posture)


def _fast_growth(matrix: Array, period: float, least: float) -> float:
    """Return the largest absolute eigenvalue of modes whose rate is at least ``least``, rad/s."""
    values = np.linalg.eigvals(matrix)
    with np.errstate(divide="ignore"):
        rates = np.abs(np.log(values.astype(complex))) / period
    return float(np.abs(values[rates >= least]).max(initial=0.0))


def _discrete(model: FlexibleModel, force: Array, period: float) -> tuple[Array, Array]:
    """Return the state a period later by the state ``[q, qdot]``, and by a held force.

    ``force``: (k, m) on the coordinates of ``model``, by the held ones.
    """
    from scipy.linalg import expm  # slow to import

    count, axes = force.shape
    rates = np.zeros((2 * count + axes, 2 * count + axes))
    rates[:count, count : 2 * count] = np.eye(count)
    sides = np.hstack([-model.stiffness, -model.damping, force])
    rates[count : 2 * count] = np.linalg.solve(model.inertia, sides)
    whole = expm(rates * period)
    return whole[: 2 * count, : 2 * count], whole[: 2 * count, 2 * count :]


def _reduced(model: FlexibleModel, rows: NDArray[np.intp]) -> FlexibleModel:
    """Eliminate all but some rows, which have no stiffness: their momentum is zero."""
    free = np.setdiff1d(np.arange(len(model.inertia)), rows)
    of = model.inertia
    share = np.linalg.solve(of[np.ix_(free, free)], of[np.ix_(free, rows)])
    inertia = of[np.ix_(rows, rows)] - of[np.ix_(rows, free)] @ share
    square = np.ix_(rows, rows)
    return FlexibleModel(inertia, model.stiffness[square], model.damping[square])


def _axis_maps(robot: Robot, size: int, base: int) -> tuple[Array, Array]:
    """Return forces (size, m) by those of the axes, and rates (m, size) as encoders see them."""
    force, rate = np.zeros((size, base + robot.n)), np.zeros((base + robot.n, size))
    for axis in range(base):
        force[3 + axis, axis] = rate[axis, 3 + axis] = 1.0
    motors = {joint: 6 + robot.joint_count + k for k, joint in enumerate(geared_joints(robot))}
    for joint in range(robot.n):
        gear, link = robot.gears[joint], 6 + joint
        motor = motors.get(joint, link)
        force[motor, base + joint] = 1.0
        rate[base + joint, motor if gear and gear.encoder == "motor" else link] = 1.0
    return force, rate
