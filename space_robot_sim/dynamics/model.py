"""What the algorithms read (`Model`, constant) and where they write (`Data`, scratch).

All vectors of `Data` are on inertial axes with the base CoM as origin, so that bodies add up
without a change of frame; spatial ones have their angular part first. Body 0 is the base,
bodies 1..n are the links.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.records import Record, shaped

Array = NDArray[np.float64]


class Model(Record):
    """A robot's numbers, as the compiled algorithms want them (SI units)."""

    mass: Array = shaped(lambda n: (n + 1,))
    """Body masses, base first."""
    inertia: Array = shaped(lambda n: (n + 1, 6))
    """Inertia about each body's CoM, on its own axes: xx, yy, zz, xy, xz, yz."""
    com: Array = shaped(lambda n: (n + 1, 3))
    """``a_i``: from the body's frame origin to its CoM, in its frame; the base's zero."""
    joint_x: Array = shaped(lambda n: (n,))
    """DH ``a_{i-1}``: along x of the previous frame to the next joint's axis."""
    joint_z: Array = shaped(lambda n: (n,))
    """DH ``d_i``: along the joint's axis."""
    twist_cos: Array = shaped(lambda n: (n,))
    """Cosine of DH ``alpha_{i-1}``."""
    twist_sin: Array = shaped(lambda n: (n,))
    """Sine of DH ``alpha_{i-1}``."""


class Data(Record):
    """Scratch of one robot: allocate once, reuse for every call."""

    rotation: Array = shaped(lambda n: (3, 3))
    """Base to inertial frame."""
    motion: Array = shaped(lambda n: (n + 1, 6))
    """``S_i``, spatial axis of joint i: ``z_i`` and ``(P_i - r_0) x z_i`` (row 0 unused)."""
    first_moment: Array = shaped(lambda n: (n + 1, 3))
    """``m_i (r_i - r_0)``."""
    inertia: Array = shaped(lambda n: (n + 1, 6))
    """Inertia of body i about the origin: xx, yy, zz, xy, xz, yz."""
    coriolis: Array = shaped(lambda n: (n + 1, 6))
    """Acceleration that the joint's motion adds to its parent's."""
    bias: Array = shaped(lambda n: (n + 1, 6))
    """Moment about the origin and force that a body's velocity alone asks for."""
    share: Array = shaped(lambda n: (n + 1, 6))
    """``U_i / D_i`` of the articulated-body recursion."""
    driving: Array = shaped(lambda n: (n + 1,))
    """``u_i / D_i`` of the articulated-body recursion."""
