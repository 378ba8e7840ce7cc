"""Data of the algorithms: `Model` (constant) and `Data` (scratch).

All vectors of `Data` are in inertial axes with the base CoM as origin, so that bodies can be summed
without frame transformations; spatial vectors have their angular part first. Body 0 is the base,
bodies 1..n are the links.
"""

from __future__ import annotations

from space_robot_msgs_py.compiled.records import Record, shaped
from space_robot_msgs_py.samples import MOST_WHEELS

from ..elementary.matrices import Array

MOST_JOINTS = 64
"""Maximum number of moving joints, actuated and passive. The algorithms' memory has this size, so
that robots of any size use the same code, see `Model.joint_count`."""
MOST_MOVING = 2 * MOST_JOINTS + MOST_WHEELS
"""Maximum number of joints, wheels and rotors of geared joints together."""


class Model(Record):
    """Constants of a robot for the compiled algorithms, SI units.

    Joints, and the bodies that they move, are in the order of visits: branch by branch. Without
    passive joints this is the order of all joint arrays; otherwise ``row`` defines it. Joint j
    moves body j + 1. Only the rows of the robot's joints are used in each array.
    """

    joint_count: float = shaped(lambda n: (), uniform=True)
    """Number N of moving joints, actuated and passive."""
    mass: Array = shaped(lambda n: (MOST_JOINTS + 1,), "Body masses, kg, base first")
    inertia: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Inertia about each body's CoM, in body axes: xx, yy, zz, xy, xz, yz, kg m2."""
    com: Array = shaped(lambda n: (MOST_JOINTS + 1, 3))
    """Vector ``a_i`` from the body's frame to its CoM, in its frame, m; zero for the base."""
    rotation: Array = shaped(lambda n: (MOST_JOINTS, 9))
    """Rotation from each joint's frame at zero to the parent body's frame, row by row. The joint's
    axis is z."""
    offset: Array = shaped(lambda n: (MOST_JOINTS, 3))
    """From the parent's frame to the joint's at zero, m, in the joint's axes at zero; for modified
    Denavit-Hartenberg parameters ``(a_{i-1}, 0, d_i)``."""
    is_prismatic: Array = shaped(lambda n: (MOST_JOINTS,), uniform=True)
    """1 for a prismatic joint, 0 for a revolute one."""
    parent: Array = shaped(lambda n: (MOST_JOINTS,), uniform=True)
    """Number of the parent body of each joint."""
    row: Array = shaped(lambda n: (MOST_JOINTS,), uniform=True)
    """Index in this model of each joint of the robot's arrays (actuated joints first)."""
    continues: Array = shaped(lambda n: (MOST_JOINTS,), uniform=True)
    """1 for a joint whose parent is the previous body; 0 at the start of a branch."""
    branches: Array = shaped(lambda n: (MOST_JOINTS + 1,), uniform=True)
    """1 for a body at which a further branch starts."""
    actuated_count: float = shaped(lambda n: (), uniform=True)
    """Number of actuated joints; the passive ones come after them."""
    stiffness: Array = shaped(lambda n: (MOST_JOINTS,))
    """Stiffness of the springs of passive joints, and of the gears of geared ones, N m/rad, or N/m
    for prismatic joints."""
    damping: Array = shaped(lambda n: (MOST_JOINTS,), "Damping of the same, N m s/rad or N s/m")
    rest: Array = shaped(lambda n: (MOST_JOINTS,))
    """Rest position of each passive joint's spring, rad or m."""
    wheel_count: float = shaped(lambda n: (), uniform=True)
    """Number of reaction wheels (`space_robot_model.dynamics.aba`), at most MOST_WHEELS."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Spin axes of the wheels, unit vectors in the base frame."""
    wheel_inertia: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia of each wheel about its axis, kg m2; included in the base's."""
    rotor_count: float = shaped(lambda n: (), uniform=True)
    """Number G of joints with gears (`space_robot_model.dynamics.aba`)."""
    rotor: Array = shaped(lambda n: (MOST_JOINTS,), uniform=True)
    """Number of each joint's rotor from 1; 0 for joints without a gear."""
    rotor_inertia: Array = shaped(lambda n: (MOST_JOINTS,))
    """Inertia of each joint's rotor about the joint's axis, kg m2; included in the parent's."""
    gear_ratio: Array = shaped(lambda n: (MOST_JOINTS,))
    """Turns of each rotor per turn of its joint; rad/m for prismatic joints."""


class Data(Record):
    """Scratch of the algorithms for one robot: allocate once, reuse for every call."""

    rotation: Array = shaped(lambda n: (3, 3), "Rotation from the base frame to the inertial frame")
    motion: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Motion subspace ``S_i`` of the joint that moves body i: ``z_i`` and ``(P_i - r_0) x z_i`` for
    a revolute joint, 0 and ``z_i`` for a prismatic one (row 0 is unused)."""
    first_moment: Array = shaped(lambda n: (MOST_JOINTS + 1, 3))
    """First moment of mass ``m_i (r_i - r_0)``, kg m."""
    inertia: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Inertia of body i about the origin: xx, yy, zz, xy, xz, yz, kg m2."""
    coriolis: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Velocity-product acceleration of the joint, Featherstone's ``c_i``."""
    bias: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Bias force ``p_i`` of body i: moment about the origin and force due to its velocity."""
    U_over_D: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """``U_i / D_i`` of the articulated-body recursion."""
    u_over_d: Array = shaped(lambda n: (MOST_JOINTS + 1,))
    """``u_i / D_i`` of the articulated-body recursion."""
    turn: Array = shaped(lambda n: (MOST_JOINTS, 2))
    """Cosine and sine of each joint's position; not used for prismatic joints."""
    frame: Array = shaped(lambda n: (MOST_JOINTS + 1, 12))
    """Axes (row by row) and origin, m, of each body."""
    outwards: Array = shaped(lambda n: (MOST_JOINTS + 1, 6))
    """Velocity or acceleration of bodies at which branches start."""
    inwards: Array = shaped(lambda n: (MOST_JOINTS + 1, 27))
    """Of the same: what the branches hand in: an articulated inertia (J, G, M) and bias force, or
    what else adds up."""
    locked: Array = shaped(lambda n: (MOST_MOVING,))
    """1 for locked joints, then wheels, then rotors; 0 for free ones."""
    holding: Array = shaped(lambda n: (MOST_MOVING,))
    """Torque of the brake of each locked joint, wheel or rotor (seen through its gear), N m."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Spin axes of the wheels in inertial axes."""
