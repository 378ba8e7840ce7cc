"""The memory of the algorithms: they read `Model` (constant) and write `Data` (scratch).

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


class Model(Record):
    """The robot's constants as the compiled algorithms read them, SI units."""

    mass: Array = shaped(lambda n: (n + 1,))
    """Body masses, kg, base first."""
    inertia: Array = shaped(lambda n: (n + 1, 6))
    """Inertia about each body's CoM, on its own axes: xx, yy, zz, xy, xz, yz, kg m2."""
    com: Array = shaped(lambda n: (n + 1, 3))
    """Vector ``a_i`` from the body's frame origin to its CoM, in its frame, m; the base's is 0."""
    a: Array = shaped(lambda n: (n,))
    """DH ``a_{i-1}``: along x of the previous frame to the next joint's axis, m."""
    d: Array = shaped(lambda n: (n,))
    """DH ``d_i``: along the joint's axis, m."""
    cos_alpha: Array = shaped(lambda n: (n,))
    """Cosine of DH ``alpha_{i-1}``."""
    sin_alpha: Array = shaped(lambda n: (n,))
    """Sine of DH ``alpha_{i-1}``."""
    wheel_count: float = shaped(lambda n: ())
    """Reaction wheels of the base, see `space_robot_sim.dynamics.wheels`; at most MOST_WHEELS."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Unit axes of the wheels, in the base's frame."""
    wheel_inertia: Array = shaped(lambda n: (MOST_WHEELS,))
    """Inertia of each wheel about its axis, kg m2; a part of the base's."""


class Data(Record):
    """Scratch of the algorithms for one robot: allocate once, reuse for every call."""

    rotation: Array = shaped(lambda n: (3, 3))
    """Rotation from the base frame to the inertial frame."""
    motion: Array = shaped(lambda n: (n + 1, 6))
    """Motion subspace ``S_i`` of joint i: ``z_i`` and ``(P_i - r_0) x z_i`` (row 0 is unused)."""
    first_moment: Array = shaped(lambda n: (n + 1, 3))
    """First moment of mass ``m_i (r_i - r_0)``, kg m."""
    inertia: Array = shaped(lambda n: (n + 1, 6))
    """Inertia of body i about the origin: xx, yy, zz, xy, xz, yz, kg m2."""
    coriolis: Array = shaped(lambda n: (n + 1, 6))
    """Acceleration that the joint's motion adds to its parent's, Featherstone's ``c_i``."""
    bias: Array = shaped(lambda n: (n + 1, 6))
    """Bias force ``p_i`` of body i: the moment about the origin and the force that its velocity
    alone asks for."""
    U_over_D: Array = shaped(lambda n: (n + 1, 6))
    """``U_i / D_i`` of the articulated-body recursion."""
    u_over_d: Array = shaped(lambda n: (n + 1,))
    """``u_i / D_i`` of the articulated-body recursion."""
    locked: Array = shaped(lambda n: (n + 1 + MOST_WHEELS,))
    """1 for joints, then wheels, that must not accelerate, 0 for free ones (row 0 is unused)."""
    holding: Array = shaped(lambda n: (n + 1 + MOST_WHEELS,))
    """Torque that a brake takes up on each locked joint so that it does not accelerate, N m."""
    wheel_axis: Array = shaped(lambda n: (MOST_WHEELS, 3))
    """Axes of the wheels."""
