"""The size of a long flight's bag, beside the room on the disk."""

from __future__ import annotations

import shutil
from pathlib import Path
from tempfile import TemporaryDirectory

from space_robot_msgs_py.errors import FlightError

from .plan import Flight, resolve
from .simulate import simulate

SAMPLE_TICKS = 2000
"""Ticks that are recorded, and thrown away, to learn how large a tick is."""


def largest_tick(joints: int) -> int:
    """Return the bytes of a tick that no bag exceeds, uncompressed: else an estimate is needed."""
    return 2000 + 200 * joints


def bag_bytes(flight: Flight) -> float:
    """Estimate the bytes of the bag of ``flight`` from its first second.

    Raises:
        FlightError: it diverges in that.
    """
    plan = flight.scenario.options.model_copy(update={"duration": SAMPLE_TICKS * flight.period})
    with TemporaryDirectory() as folder:
        bag = Path(folder) / "bag"
        simulate(Flight(resolve(plan)), bag)
        size = sum(file.stat().st_size for file in bag.iterdir())
    return size / SAMPLE_TICKS * flight.ticks


def disk_space_warning(flight: Flight, bag: Path) -> str:
    """Return a line that says that ``bag`` will not have room; empty if it will."""
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
