"""Flights on a device, of any number: in batches that fit into its memory."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import click

from space_robot_msgs_py.config.validation import one_of

from ..flight.batch import FlownInBatch
from ..flight.plan import Flight
from .device import Device

DEVICES = ("cpu", "gpu")
MOST_FLIGHTS = 512
"""Of a batch: their logs are in this computer's memory, 5 MB for a second of each."""
RESERVE = 0.8
"""Share of the free memory that a batch may take."""


def device_named(name: str) -> Device | None:
    """Return a device by its name; None for ``cpu``.

    Raises:
        InputError: no such device, or it cannot be used.
    """
    if one_of(name, DEVICES, "device") == "cpu":
        return None
    from .cuda import find_device

    return find_device()


def fly_on_device(
    flights: Sequence[Flight],
    device: Device,
    is_brief: bool = False,
    progress: Callable[[int], object] = lambda flown: None,
) -> list[FlownInBatch]:
    """Fly flights of one `batch_key` on a device; return them as they ended, in their order.

    Each has the bits of `simulate`. Where the device's memory is too small, fewer fly at a time.

    Args:
        flights: checked.
        device: where they fly.
        is_brief: see `empty_log`.
        progress: called with the number of flights that are over.

    Raises:
        InputError: a kernel has no translation, or the memory is too small for one flight.
    """
    from .batch import LOG_BYTES, DeviceBatch  # the translator is for those who use it

    flown: list[FlownInBatch] = []
    size = min(len(flights), MOST_FLIGHTS)
    while len(flown) < len(flights):
        part = flights[len(flown) : len(flown) + size]
        batch = DeviceBatch(part, device, is_brief)
        if batch.device_bytes > RESERVE * device.free_bytes - LOG_BYTES and len(part) > 1:
            size = max(1, len(part) // 2)
            click.echo(f"device gpu: little memory is free: {size} flights at a time", err=True)
            continue
        flown += [one._replace(flight=len(flown) + one.flight) for one in batch.fly()]
        progress(len(flown))
    return flown
