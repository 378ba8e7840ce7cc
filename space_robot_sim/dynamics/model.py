"""What the algorithms read (`Model`, constant) and where they write (`Data`, scratch).

All vectors of `Data` are on inertial axes with the base CoM as origin, so that bodies add up
without a change of frame. Body 0 is the base, bodies 1..n are the links.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


class Model(NamedTuple):
    """A robot's numbers, as the compiled algorithms want them (SI units)."""

    mass: Array
    """(n+1,) body masses, base first."""
    inertia: Array
    """(n+1, 3, 3) inertia about each body's CoM, on its own axes."""
    com: Array
    """(n+1, 3) ``a_i``: from the body's frame origin to its CoM, in its frame; the base's zero."""
    joint_x: Array
    """(n,) DH ``a_{i-1}``: along x of the previous frame to the next joint's axis."""
    joint_z: Array
    """(n,) DH ``d_i``: along the joint's axis."""
    twist_cos: Array
    """(n,) cosine of DH ``alpha_{i-1}``."""
    twist_sin: Array
    """(n,) sine of DH ``alpha_{i-1}``."""


class Data(NamedTuple):
    """Scratch of one robot: allocate once (`allocate`), reuse for every call."""

    rotation: Array
    """(n+1, 3, 3) body axes in the inertial frame."""
    joint: Array
    """(n+1, 3) ``P_i - r_0``, position of joint i (row 0 zero)."""
    com: Array
    """(n+1, 3) ``r_i - r_0``, position of the CoM of body i."""
    inertia: Array
    """(n+1, 3, 3) ``I_i`` on inertial axes."""
    velocity: Array
    """(n+1, 6) spatial velocity at the origin, angular part first."""
    bias: Array
    """(n+1, 6) spatial force (moment about the origin, force): bias, then articulated bias."""
    coriolis: Array
    """(n+1, 6) ``c_i``, acceleration that the joint's motion adds to its parent's."""
    spatial_inertia: Array
    """(n+1, 6, 6) spatial inertia at the origin: composite or articulated."""
    motion: Array
    """(n+1, 6) ``S_i``, spatial axis of joint i: ``z_i`` and ``P_i x z_i`` (row 0 unused)."""
    momentum: Array
    """(n+1, 6) ``U_i``: the inertia times ``S_i``."""
    scalar: Array
    """(n+1, 2) ``D_i`` and ``u_i`` of the articulated-body recursion."""
    acceleration: Array
    """(n+1, 6) spatial acceleration at the origin."""


def allocate(n: int) -> Data:
    """Scratch for a robot of ``n`` joints."""
    bodies = n + 1
    spatial = [np.zeros((bodies, 6)) for _ in range(6)]
    return Data(
        rotation=np.zeros((bodies, 3, 3)),
        joint=np.zeros((bodies, 3)),
        com=np.zeros((bodies, 3)),
        inertia=np.zeros((bodies, 3, 3)),
        velocity=spatial[0],
        bias=spatial[1],
        coriolis=spatial[2],
        spatial_inertia=np.zeros((bodies, 6, 6)),
        motion=spatial[3],
        momentum=spatial[4],
        scalar=np.zeros((bodies, 2)),
        acceleration=spatial[5],
    )
