"""Do the peers simulate the same robot? Their end states beside the plant's."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np

from ..result import Result, Target
from . import is_installed
from .simulators import PERIOD, MuJoCo, Ours, Peer, Pinocchio, Start

TOLERANCE = Target(1e-9)
"""Largest difference in any of position (m), quaternion, angles (rad) and rates at the end."""
LOOSER = {"mujoco": Target(1e-8)}
"""It turns inertias to principal axes by an iteration: 1e-11 apart, but 1.02e-9 in version 3.17."""
MOTION = Target(1e-3)
"""The least that the plant moves: at rest every robot is the same."""


def all_peers(start: Start) -> list[Peer]:
    """Those that are installed, without friction."""
    peers: list[Peer] = [MuJoCo(start), Pinocchio(start)]
    if is_installed("Basilisk"):
        from .basilisk import Basilisk

        peers.append(Basilisk(start))
    return peers


def same_motion(start: Start, peers: Iterable[Peer], steps: int) -> list[Result]:
    """Integrate everybody from ``start``; the torques of ``start`` act, nothing else.

    The first row tells how far the plant moves, the others how far a peer then is from it.
    """
    ours = Ours(start, with_environment=False)
    ours.step(steps)
    flown = f"{start.robot.n} joints, {steps * PERIOD:g} s"
    rows = [
        Result(
            f"{flown}: motion",
            "",
            (difference(start.x, ours.x),),
            target=MOTION,
            better="more",
            is_condition=True,
        )
    ]
    for peer in peers:
        peer.step(steps)
        apart = difference(ours.x, peer.x)
        rows.append(
            Result(
                f"{flown}: {peer.name} apart",
                "",
                (apart,),
                target=LOOSER.get(peer.name, TOLERANCE),
                is_condition=True,
            )
        )
    return rows


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two states; the sign of a quaternion means nothing."""
    other = other.copy()
    if one[3:7] @ other[3:7] < 0.0:
        other[3:7] *= -1.0
    return float(np.max(np.abs(one - other)))
