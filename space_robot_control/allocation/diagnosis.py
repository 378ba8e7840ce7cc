"""Diagnosis of the base's actuators by the flight software."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from .allocation import Allocation

AXES = 3


class Diagnosis(NamedTuple):
    """Health of the base's actuators, as the allocation sees it."""

    failed: tuple[str, ...]
    """Names of the wheels excluded from the allocation."""
    summary: str
    """One-line summary; empty without problems."""
    values: dict[str, float | int | str]
    """Values for diagnostics; empty without allocation."""


def diagnose(allocation: Allocation) -> Diagnosis:
    """Return the diagnosis from the allocation's memory."""
    if allocation.is_used == 0.0:
        return Diagnosis((), "", {})
    wheels, thrusters, torquers = allocation.wheels, allocation.thrusters, allocation.torquers
    count, rank = int(wheels.count), int(wheels.healthy.rank)
    failed = tuple(
        f"wheel_{k + 1}" for k in np.flatnonzero(wheels.healthy.takes_part[:count] == 0.0)
    )
    values: dict[str, float | int | str] = {}
    if count:
        shares = np.abs(wheels.momentum[:count]) / wheels.max_momentum[:count]
        values |= {
            "wheel_axes": rank,
            "fullest_wheel": float(shares.max()),
            "demand_scaled_ticks": int(wheels.scaled_ticks),
            "wheel_full_ticks": int(wheels.full_ticks),
        }
    if failed:
        values["failed"] = ", ".join(failed)
    if thrusters.count:
        values["pulses"] = int(allocation.modulation.pulses.sum())
    if thrusters.count and count:
        values["unloading"] = "yes" if allocation.unloading.is_active else "no"
    if torquers.count:
        values["largest_dipole"] = float(np.abs(torquers.dipole).max())
    return Diagnosis(failed, _summary(failed, rank, bool(thrusters.count)), values)


def _summary(failed: tuple[str, ...], rank: int, has_thrusters: bool) -> str:
    if not failed:
        return ""
    text = f"{', '.join(failed)} failed, left out"
    if rank == AXES:
        return text
    rest = "thrusters take the others" if has_thrusters else "the base is not controlled fully"
    return f"{text}: wheels turn {rank} of {AXES} axes, {rest}"
