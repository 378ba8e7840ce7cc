"""Whether the machine can keep the ticks of a flight by the wall clock."""

from __future__ import annotations

import os
import time
from typing import NamedTuple

import numpy as np

from space_robot_sim.plant.pacing import SPIN_BEFORE_DEADLINE_S, WallClock

from .checked_item import CheckedItem

PERIOD_S = 0.0005
"""Period of the paper's controller: 2 kHz."""
DURATION_S = 2.0
POLICIES = {os.SCHED_OTHER: "SCHED_OTHER", os.SCHED_FIFO: "SCHED_FIFO", os.SCHED_RR: "SCHED_RR"}


class DeadlineLateness(NamedTuple):
    """How late the ends of ticks were noticed."""

    period_s: float
    ticks: int
    median_s: float
    percentile_99_s: float
    worst_s: float
    late_ticks: int
    """Ticks that ended more than a period late."""
    lost_time_s: float
    """Time by which the wall clock ran ahead for good, as `WallClock` counts it."""

    @property
    def is_kept(self) -> bool:
        """True if 99 % of the ticks ended within a period of their deadline."""
        return self.percentile_99_s < self.period_s and not self.lost_time_s


def measure_lateness(
    period_s: float = PERIOD_S, duration_s: float = DURATION_S
) -> DeadlineLateness:
    """Wait for deadlines as the plant node does by the wall clock, without a flight.

    Args:
        period_s: of the deadlines.
        duration_s: of the measurement; it takes longer where the clock is not kept.
    """
    ticks = max(1, round(duration_s / period_s))
    lateness = np.zeros(ticks)
    clock = WallClock(period_s)
    clock.start(0)
    for tick in range(ticks):
        while (left := clock.left(tick)) > 0.0:
            if left > SPIN_BEFORE_DEADLINE_S:
                time.sleep(left - SPIN_BEFORE_DEADLINE_S)
        lateness[tick] = -left
        clock.slip(tick)
    median, high = np.percentile(lateness, [50, 99])
    return DeadlineLateness(
        period_s,
        ticks,
        float(median),
        float(high),
        float(lateness.max()),
        int((lateness > period_s).sum()),
        clock.lost_time_s,
    )


def check_deadlines(lateness: DeadlineLateness) -> CheckedItem:
    """Judge a measurement: can a flight with ``--realtime`` keep this period here?"""
    rate = f"{1e-3 / lateness.period_s:g} kHz"
    numbers = (
        f"late by {_microseconds(lateness.median_s)} (median), "
        f"{_microseconds(lateness.percentile_99_s)} (99 %), "
        f"{_microseconds(lateness.worst_s)} (worst)"
    )
    share = f"{lateness.late_ticks} of {lateness.ticks} ticks more than a period late"
    values = lateness._asdict()
    if lateness.is_kept:
        text = f"{rate} can be kept by the wall clock: {numbers}; {share}"
        return CheckedItem("wall clock", "ok", text, values=values)
    return CheckedItem(
        "wall clock",
        "warning",
        f"{rate} cannot be kept by the wall clock: {numbers}; {share}",
        "close other programs, or fly --realtime with a longer --period; flights without "
        "--realtime are not affected",
        values,
    )


def check_scheduling(cores: frozenset[int] | None = None) -> CheckedItem:
    """Report the clock's resolution, the scheduling policy, and the cores that may be used.

    Args:
        cores: that this process may run on; None: those that the system says.
    """
    usable = len(os.sched_getaffinity(0) if cores is None else cores)
    resolution = time.get_clock_info("monotonic").resolution
    policy = POLICIES.get(os.sched_getscheduler(0), "another policy")
    load = os.getloadavg()[0]
    values = {
        "cores": usable,
        "clock_resolution_s": resolution,
        "policy": policy,
        "load_average": load,
    }
    text = (
        f"{usable} of {os.cpu_count()} cores, load {load:.1f}; {policy}; "
        f"clock resolution {1e9 * resolution:g} ns"
    )
    if usable < 2:
        advice = "a graph of nodes flies faster with two cores; one core is enough for simulate"
        return CheckedItem("processor", "warning", text, advice, values)
    if load > usable:
        advice = "other programs use the processor: flights take longer"
        return CheckedItem("processor", "warning", text, advice, values)
    return CheckedItem("processor", "ok", text, values=values)


def _microseconds(seconds: float) -> str:
    return f"{1e6 * seconds:.0f} us"
