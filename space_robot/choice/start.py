"""Gains from which a search begins: the tuned ones, with what the method may have set absurdly.

A tuned gain set has one margin in all directions. For a heavy satellite with a light wrist that
takes a huge inertia of the estimate, a low-pass of less than 1 Hz and a bandwidth of 0.01 rad/s:
no place to begin.
"""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from space_robot_model.elementary.matrices import Array

from ..tuning.estimate_design import K_1_FACTOR
from ..tuning.method import Tuned
from .search_space import BANDWIDTH, KNOWN, GainPoint

LEAST_BANDWIDTH = 2.0
"""rad/s."""
SWITCHED = 0.1
"""Torque by which a law switches in a tick, as a share of the ripple allowed."""


def first_points(tuned: Tuned, peak: Array, ripple: float, period: float) -> dict[str, GainPoint]:
    """Return a start for each law of a tuned set.

    The inertia of estimates is diagonal, such that the largest eigenvalue of its product with the
    inverse of the robot's is 1: the estimate converges without a low-pass.

    Args:
        tuned: the set.
        peak: largest force of the mission on each axis (m,), N m.
        ripple: allowed, a share of it.
        period: of the ticks, s.
    """
    inertia = tuned.constant.h_bar / tuned.constant.largest
    switched = SWITCHED * ripple * peak
    rough = 2.0 * switched / (K_1_FACTOR**2 * inertia * period)
    absolute: Mapping[str, Mapping[str, Array]] = {
        "dob": {"inertia": inertia},
        "adrc": {"inertia": inertia},
        "tde_smc": {"h_bar": inertia, "g": switched},
        "tde_tsmc": {"h_bar": inertia, "k_1": np.sqrt(rough)},
        "tde_stc": {"h_bar": inertia, "k_1": K_1_FACTOR * np.sqrt(rough), "k_2": 1.1 * rough},
    }
    points = {}
    for law, own in tuned.laws.items():
        faster = max(1.0, LEAST_BANDWIDTH / own.bandwidth)
        powers = next(factor.powers for factor in KNOWN[law] if factor.name == BANDWIDTH)
        gains = {name: own.gains[name] * faster ** powers.get(name, 0.0) for name in own.gains}
        gains |= absolute.get(law, {})
        points[law] = GainPoint(gains, tuned.corner_hz, own.bandwidth * faster)
    return points
