"""Estimated size of a bag compared with the free disk space."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from space_robot_msgs_py.errors import FlightError

from .plan import Flight, resolve
from .simulate import simulate

SAMPLE_TICKS = 2000
"""Ticks recorded and discarded to measure the size of a tick."""


def largest_tick(joints: int) -> int:
    """Return an upper bound of the uncompressed size of a tick, bytes."""
    return 2000 + 200 * joints


def bag_bytes(flight: Flight) -> float:
    """Estimate the bytes of the bag of ``flight`` from its first second.

    Raises:
        FlightError: the flight diverges in that second.
    """
    plan = flight.scenario.options.model_copy(update={"duration": SAMPLE_TICKS * flight.period})
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        simulate(Flight(resolve(plan)), bag)
        size = sum(file.stat().st_size for file in bag.iterdir())
    return size / SAMPLE_TICKS * flight.ticks


def disk_space_warning(flight: Flight, bag: Path) -> str:
    """Return a warning if the disk has no room for ``bag``; empty if it has."""
    free = shutil.disk_usage(next(p for p in bag.absolute().parents if p.exists())).free
    if flight.ticks * largest_tick(flight.robot.joint_count) <= free:
        return ""
    try:
        size = bag_bytes(flight)
    except FlightError:
        return ""
    if size <= free:
        return ""
    return (
        f"--bag {bag}: {flight.ticks * flight.period:g} s make about {size / 1e9:.3g} GB, "
        f"{free / 1e9:.3g} GB are free there: the bag will end when the disk is full"
    )
