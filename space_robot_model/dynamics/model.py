"""Data of the algorithms: `Model` (constant) and `Data` (scratch).

All vectors of `Data` are on inertial axes with the base CoM as origin, so that bodies add up
without a change of frame; spatial ones have their angular part first. Body 0 is the base,
bodies 1..n are the links.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

Array = NDArray[np.float64]


MOST_JOINTS = 64
"""Joints that move, actuated and passive. The algorithms' memory has room for as many, so that a
robot of another size needs no other code: see `Model.joint_count`."""


class Model(Record):
    """The robot's constants as the compiled algorithms read them, SI units.

    Joints, and the bodies that they move, are in the order in which they are visited: down each
    branch in turn. For a robot without passive joints that is the order of all joint arrays; with
    them it is given by ``row``. Joint j moves body j + 1. Only the rows of the robot's joints
    are used in each array.
    """

    joint_count: float = shaped(lambda n: ())
    """Number N of joints that move, actuated and passive."""
    mass: Array = shaped(lambda n: (MOST_JOINTS + 1,))
    """Body masses, kg, base first."""
    inertia: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Inertia about each body's CoM, on its own axes: xx, yy, zz, xy, xz, yz, kg m2."""
    com: Array = shaped(lambda n: (MOST_JOINTS + 1, 3))
    """Vector ``a_i`` from the body's frame origin to its CoM, in its frame, m; the base's is 0."""
    rotation: Array = shaped(lambda n: (MOST_JOINTS, 9))
    """Axes of each joint's frame at zero on the axes of the body it moves against: a rotation,
    row by row. The joint's axis is z."""
    offset: Array = shaped(lambda n: (MOST_JOINTS, 3))
    """From that body's frame to the joint's at zero, m, on the joint's axes at zero; of modified
    Denavit-Hartenberg numbers it is ``(a_{i-1}, 0, d_i)``."""
    is_prismatic: Array = shaped(lambda n: (MOST_JOINTS,))
    """1 for a joint that slides along its axis, 0 for one that turns about it."""
    parent: Array = shaped(lambda n: (MOST_JOINTS,))
    """Number of the body that each joint moves against."""
    row: Array = shaped(lambda n: (MOST_JOINTS,))
    """Index in the model of each joint of the robot's arrays (actuated joints first)."""
    continues: Array = shaped(lambda n: (MOST_JOINTS,))
    """1 for a joint whose parent is the body visited before it; 0: a branch begins."""
    branches: Array = shaped(lambda n: (MOST_JOINTS + 1,))
    """1 for a body that a branch begins at after another one has been visited."""
    actuated_count: float = shaped(lambda n: ())
    """Number of joints with a motor; the passive ones are behind them."""
    stiffness: Array = shaped(lambda n: (MOST_JOINTS,))
    """Stiffness of the passive joints' springs, N m/rad, or N/m of prismatic joints."""
    damping: Array = shaped(lambda n: (MOST_JOINTS,))
    """Damping of the passive joints, N m s/rad or N s/m."""
    rest: Array = shaped(lambda n: (MOST_JOINTS,))
    """Rest position of each spring, rad or m."""
    wheel_count: float = shaped(lambda n: ())
    """Reaction wheels of the base, see `space_robot_model.dynamics.wheels`; at most MOST_WHEELS."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Unit axes of the wheels, in the base's frame."""
    wheel_inertia: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia of each wheel about its axis, kg m2; a part of the base's."""


class Data(Record):
    """Scratch of the algorithms for one robot: allocate once, reuse for every call."""

    rotation: Array = shaped(lambda n: (3, 3))
    """Rotation from the base frame to the inertial frame."""
    motion: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Motion subspace ``S_i`` of the joint that moves body i: ``z_i`` and ``(P_i - r_0) x z_i`` of
    one that turns, 0 and ``z_i`` of one that slides (row 0 is unused)."""
    first_moment: Array = shaped(lambda n: (MOST_JOINTS + 1, 3))
    """First moment of mass ``m_i (r_i - r_0)``, kg m."""
    inertia: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Inertia of body i about the origin: xx, yy, zz, xy, xz, yz, kg m2."""
    coriolis: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Acceleration that the joint's motion adds to its parent's, Featherstone's ``c_i``."""
    bias: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Bias force ``p_i`` of body i: the moment about the origin and the force that its velocity
    alone asks for."""
    U_over_D: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """``U_i / D_i`` of the articulated-body recursion."""
    u_over_d: Array = shaped(lambda n: (MOST_JOINTS + 1,))
    """``u_i / D_i`` of the articulated-body recursion."""
    turn: Array = shaped(lambda n: (MOST_JOINTS, 2))
    """Cosine and sine of each joint's position; of no meaning for one that slides."""
    frame: Array = shaped(lambda n: (MOST_JOINTS + 1, 12))
    """Of each body: axes (row by row) and origin, m."""
    outwards: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Of bodies that branches begin at: velocity or acceleration, handed on to the branches."""
    inwards: Array = shaped(lambda n: (MOST_JOINTS + 1, 27))
    """Of the same: what the branches hand in: an articulated inertia (J, G, M) and bias force, or
    what else adds up."""
    locked: Array = shaped(lambda n: (MOST_JOINTS + MOST_WHEELS,))
    """1 for joints, then wheels, that must not accelerate, 0 for free ones."""
    holding: Array = shaped(lambda n: (MOST_JOINTS + MOST_WHEELS,))
    """Torque that a brake takes up on each locked joint so that it does not accelerate, N m."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Axes of the wheels."""
