"""Whether the peers simulate the same robot: their end states beside the plant's."""

from __future__ import annotations

import importlib.util
from collections.abc import Iterable
from typing import Any

import numpy as np
from peers import PERIOD, MuJoCo, Ours, Peer, Pinocchio, Start

TOLERANCE = 1e-9
"""Largest difference in any of position (m), quaternion, angles (rad) and rates, after 0.2 s."""
HAS_BASILISK = importlib.util.find_spec("Basilisk") is not None


def all_peers(start: Start) -> list[Peer]:
    """Those that are installed, without friction."""
    peers: list[Peer] = [MuJoCo(start), Pinocchio(start)]
    if HAS_BASILISK:
        from basilisk import Basilisk

        peers.append(Basilisk(start))
    return peers


def same_motion(start: Start, peers: Iterable[Peer], steps: int) -> list[dict[str, Any]]:
    """Integrate everybody from ``start``; the torques of ``start`` act, nothing else."""
    ours = Ours(start, with_environment=False)
    ours.step(steps)
    found = []
    for peer in peers:
        peer.step(steps)
        apart = difference(ours.x, peer.x)
        found.append({
            "peer": peer.name,
            "joints": start.robot.n,
            "time_s": steps * PERIOD,
            "moved": difference(start.x, ours.x),
            "apart": apart,
            "tolerance": TOLERANCE,
            "same": bool(apart <= TOLERANCE),
        })  # fmt: skip
    return found


def difference(one: np.ndarray, other: np.ndarray) -> float:
    """Largest difference of two states; the sign of a quaternion means nothing."""
    other = other.copy()
    if one[3:7] @ other[3:7] < 0.0:
        other[3:7] *= -1.0
    return float(np.max(np.abs(one - other)))
