"""Flights on a device, of any number: in batches that fit into its memory."""

from __future__ import annotations

from collections.abc import Sequence

import click

from space_robot_msgs_py.config.validation import one_of

from ..flight.batch import FlownInBatch
from ..flight.flown_log import row_bytes
from ..flight.plan import Flight
from .device import Device, DeviceError

DEVICES = ("cpu", "gpu")
MOST_FLIGHTS = 512
"""Of a batch."""
HOST_BYTES = 4 << 30
"""Of a batch: its logs on this computer."""
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
    flights: Sequence[Flight], device: Device, is_brief: bool = False
) -> list[FlownInBatch]:
    """Fly flights of one `batch_key` on a device; return them as they ended, in their order.

    Each has the bits of `simulate`. Where the device's memory is too small, fewer fly at a time.

    Args:
        flights: checked.
        device: where they fly.
        is_brief: see `empty_log`.

    Raises:
        InputError: a kernel has no translation.
        DeviceError: the device has failed, or its memory is too small for one flight.
    """
    from .batch import LOG_BYTES, DeviceBatch  # the translator is for those who use it

    flown: list[FlownInBatch] = []
    of_log = max(1, flights[0].ticks * row_bytes(flights[0]))
    size = max(1, min(len(flights), MOST_FLIGHTS, HOST_BYTES // of_log))
    while len(flown) < len(flights):
        part = flights[len(flown) : len(flown) + size]
        batch = DeviceBatch(part, device, is_brief)
        if (needed := batch.device_bytes) > RESERVE * device.free_bytes - LOG_BYTES:
            if len(part) == 1:
                free = f"{device.free_bytes / 1e9:.1f} GB of {device.name} are free"
                raise DeviceError(f"device gpu: a flight needs {needed / 1e9:.1f} GB: {free}")
            size = max(1, len(part) // 2)
            click.echo(f"device gpu: little memory is free: {size} flights at a time", err=True)
            continue
        flown += [one._replace(flight=len(flown) + one.flight) for one in batch.fly()]
    return flown
