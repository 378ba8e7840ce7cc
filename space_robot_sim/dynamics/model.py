"""What the algorithms read (`Model`, constant) and where they write (`Data`, scratch).

All vectors of `Data` are on inertial axes with the base CoM as origin, so that bodies add up
without a change of frame. Body 0 is the base, bodies 1..n are the links.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from ..records import Record, shaped

Array = NDArray[np.float64]


class Model(Record):
    """A robot's numbers, as the compiled algorithms want them (SI units)."""

    mass: Array = shaped(lambda n: (n + 1,))
    """Body masses, base first."""
    inertia: Array = shaped(lambda n: (n + 1, 3, 3))
    """Inertia about each body's CoM, on its own axes."""
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

    rotation: Array = shaped(lambda n: (n + 1, 3, 3))
    """Body axes in the inertial frame."""
    joint: Array = shaped(lambda n: (n + 1, 3))
    """``P_i - r_0``, position of joint i (row 0 zero)."""
    com: Array = shaped(lambda n: (n + 1, 3))
    """``r_i - r_0``, position of the CoM of body i."""
    inertia: Array = shaped(lambda n: (n + 1, 3, 3))
    """``I_i`` on inertial axes."""
    velocity: Array = shaped(lambda n: (n + 1, 6))
    """Spatial velocity at the origin, angular part first."""
    bias: Array = shaped(lambda n: (n + 1, 6))
    """Spatial force (moment about the origin, force): bias, then articulated bias."""
    coriolis: Array = shaped(lambda n: (n + 1, 6))
    """``c_i``, acceleration that the joint's motion adds to its parent's."""
    spatial_inertia: Array = shaped(lambda n: (n + 1, 6, 6))
    """Spatial inertia at the origin: composite or articulated."""
    motion: Array = shaped(lambda n: (n + 1, 6))
    """``S_i``, spatial axis of joint i: ``z_i`` and ``P_i x z_i`` (row 0 unused)."""
    momentum: Array = shaped(lambda n: (n + 1, 6))
    """``U_i``: the inertia times ``S_i``."""
    scalar: Array = shaped(lambda n: (n + 1, 2))
    """``D_i`` and ``u_i`` of the articulated-body recursion."""
    acceleration: Array = shaped(lambda n: (n + 1, 6))
    """Spatial acceleration at the origin."""
