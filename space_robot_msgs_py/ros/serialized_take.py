"""Takes serialized messages with their publisher's identity, which rclpy does not return.

It calls the C interface of rcl in ROS 2 Jazzy directly (`rcl_take_serialized_message`,
`rmw_message_info_t`), through ``pointer`` of a subscription's handle. This is also faster than
rclpy. With other versions than `rclpy_internals.VERSIONS`, or with unexpected libraries, messages
are taken by rclpy, without their publisher's identity.
"""

from __future__ import annotations

import ctypes
from collections.abc import Callable
from functools import cache
from typing import Any, NamedTuple

from .rclpy_internals import is_known_version, pointer, take_serialized, tells_pointers

ROOM = 4096
"""Initial size of the message buffer, bytes; rcl enlarges it if necessary."""
OK, NOTHING_THERE = 0, 401
GID_BYTES = 16
NOT_COUNTED = (1 << 64) - 1
"""Sequence number in rmw of a middleware without sequence numbers."""


class Received(NamedTuple):
    """A serialized message with its origin."""

    data: bytes
    sent_ns: int
    """Time of sending by the sender's clock, ns since 1970."""
    publisher: bytes
    """GID of the publisher; in RTPS its first 12 bytes identify the participant. Empty: unknown."""
    sequence: int
    """The publisher's sequence number of the message, from 1; 0: unknown."""


class _Allocator(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_void_p)
        for name in ("allocate", "deallocate", "reallocate", "zero_allocate", "state")
    ]


class _Bytes(ctypes.Structure):
    _fields_ = [
        ("buffer", ctypes.c_void_p),
        ("length", ctypes.c_size_t),
        ("capacity", ctypes.c_size_t),
        ("allocator", _Allocator),
    ]


class _Gid(ctypes.Structure):
    _fields_ = [("implementation", ctypes.c_char_p), ("data", ctypes.c_char * GID_BYTES)]


class _Info(ctypes.Structure):
    _fields_ = [
        ("source_timestamp", ctypes.c_int64),
        ("received_timestamp", ctypes.c_int64),
        ("publication_sequence_number", ctypes.c_uint64),
        ("reception_sequence_number", ctypes.c_uint64),
        ("publisher_gid", _Gid),
        ("from_intra_process", ctypes.c_bool),
    ]


Take = Callable[[Any, Any], Received | None]
"""Takes the next message of a subscription, given rclpy's handle and type; None if none waits."""


class SerializedTake:
    """Takes messages of any subscription with one buffer; not thread-safe."""

    def __init__(self) -> None:
        """Load the functions of rcl.

        Raises:
            OSError: a library is missing.
            AttributeError: a function is missing.
        """
        self._take = ctypes.CDLL("librcl.so").rcl_take_serialized_message  # rclpy has loaded it
        self._take.argtypes = [ctypes.c_void_p] * 4
        utilities = ctypes.CDLL("librcutils.so")
        utilities.rcutils_get_default_allocator.restype = _Allocator
        allocator = utilities.rcutils_get_default_allocator()
        self._bytes, self._info = _Bytes(), _Info()
        made = utilities.rcutils_uint8_array_init(
            ctypes.byref(self._bytes), ctypes.c_size_t(ROOM), ctypes.byref(allocator)
        )
        if made != OK:
            raise MemoryError
        self._addresses = ctypes.addressof(self._bytes), ctypes.addressof(self._info)
        gid_at = _Info.publisher_gid.offset + _Gid.data.offset
        self._gid = (ctypes.c_char * GID_BYTES).from_buffer(self._info, gid_at)

    def __call__(self, handle: Any, message_type: Any) -> Received | None:
        """Take the next message with its publisher; None if none waits."""
        with handle:
            code = self._take(pointer(handle), *self._addresses, None)
        if code == NOTHING_THERE:
            return None
        if code != OK:
            raise RuntimeError(f"rcl_take_serialized_message: {code}")
        info = self._info
        sequence = info.publication_sequence_number
        return Received(
            ctypes.string_at(self._bytes.buffer, self._bytes.length),
            info.source_timestamp,
            self._gid.raw,
            0 if sequence == NOT_COUNTED else sequence,
        )


def take_by_rclpy(handle: Any, message_type: Any) -> Received | None:
    """Take the next message by rclpy, without its publisher; None if none waits."""
    taken = take_serialized(handle, message_type)
    if taken is None:
        return None
    data, info = taken
    sequence = info["publication_sequence_number"]
    return Received(data, info["source_timestamp"], b"", 0 if sequence == NOT_COUNTED else sequence)


@cache
def serialized_take() -> Take:
    """Return the function of this process: `SerializedTake`, or else `take_by_rclpy`."""
    try:
        if is_known_version() and tells_pointers():
            return SerializedTake()
    except (OSError, AttributeError):
        pass
    return take_by_rclpy
