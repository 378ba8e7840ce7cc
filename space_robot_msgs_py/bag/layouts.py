"""The numbers of many messages at once, whatever their layout.

The first message of a layout is decoded the general way; it tells where the numbers stand in all
that are laid out alike.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..cdr import CdrBuilder, FixedMessage, Slot
from ..decoded import name_order
from ..definitions import decode
from ..errors import MessageError
from .batch import Batch
from .kernels import Bytes, Integers, gather

Array = NDArray[np.float64]


class Layout(NamedTuple):
    """Where a message's numbers stand, and which of them to take in which order."""

    layout: Bytes
    constant: Bytes
    runs: Integers
    order: list[int]

    @classmethod
    def of(cls, message: FixedMessage, slots: Sequence[Slot], order: list[int]) -> Layout:
        """The numbers of ``slots``, sorted by ``order``."""
        runs = [message.run(slot) for slot in slots if slot.count]
        return cls(*message.pattern, np.array(runs, np.int64).reshape(-1, 2), order)


Describe = Callable[[Any], Layout]
"""The layout of a decoded message; a `MessageError`: it does not fit."""


class Numbers:
    """Takes the numbers out of the messages of a topic."""

    def __init__(self, type_name: str, width: int, describe: Describe) -> None:
        """``width``: numbers in a message."""
        self._type, self._width, self._describe = type_name, width, describe
        self._layout: Layout | None = None
        self.fault = ""
        """Why the first of the messages that did not fit did not."""

    def read(self, batch: Batch) -> tuple[Array, NDArray[np.bool_]]:
        """(M, width) numbers, and (M,) of which messages they could be read."""
        values = np.full((len(batch), self._width), np.nan)
        good = np.zeros(len(batch), np.bool_)
        left = np.arange(len(batch))
        if self._layout:
            left = self._take(self._layout, batch, left, values, good)
        while len(left):
            try:
                self._layout = self._describe(decode(batch.message(left[0]), self._type))
            except MessageError as error:
                self.fault = self.fault or str(error)
                left = left[1:]
            else:
                rest = self._take(self._layout, batch, left, values, good)
                left = rest if len(rest) < len(left) else left[1:]
        return values, good

    def _take(
        self, layout: Layout, batch: Batch, left: NDArray[np.intp], values: Array,
        good: NDArray[np.bool_],
    ) -> NDArray[np.intp]:  # fmt: skip
        """Read those of the messages ``left`` that are laid out so; returns the others."""
        found = np.empty((len(left), self._width))
        fits = np.empty(len(left), np.bool_)
        gather(
            batch.data, batch.starts[left], batch.lengths[left], layout.layout, layout.constant,
            layout.runs, found.view(np.uint8), fits,
        )  # fmt: skip
        values[left[fits]] = found[fits][:, layout.order]
        good[left[fits]] = True
        return left[~fits]


def joint_states(topic: topics.Topic, names: Sequence[str], fields: Sequence[str]) -> Describe:
    """The ``fields`` of a sensor_msgs/JointState, one behind the other, each in order of names."""

    def describe(message: Any) -> Layout:
        order = name_order(message.name, names, topic.name)
        builder = CdrBuilder()
        builder.header_slot(message.header.frame_id)
        builder.strings(message.name)
        slots = {}
        for field in ("position", "velocity", "effort"):
            count = len(getattr(message, field))
            if field in fields and count != len(names):
                raise MessageError(
                    f"{topic.name}: {count} values of {field} for {len(names)} names", "size"
                )
            slots[field] = builder.float64_sequence_slot(count)
        columns = [i * len(names) + k for i in range(len(fields)) for k in order]
        return Layout.of(builder.build(), [slots[field] for field in fields], columns)

    return describe


BASE_WIDTH = 19
"""Pose (position, quaternion x y z w), twist (linear, angular), wrench (force, torque)."""


def base_state(message: Any) -> Layout:
    """All numbers of a sensor_msgs/MultiDOFJointState of one body."""
    name_order(message.joint_names, [topics.BASE_FRAME], topics.BASE_STATE.name)
    if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
        raise MessageError(f"{topics.BASE_STATE.name}: one transform, twist, wrench expected")
    builder = CdrBuilder()
    builder.header_slot(message.header.frame_id)
    builder.strings(message.joint_names)
    slots = []
    for width in (7, 6, 6):
        builder.uint32(1)
        slots.append(builder.float64_slot(width))
    return Layout.of(builder.build(), slots, list(range(BASE_WIDTH)))


def first_number(message: Any) -> Layout:
    """The first number of a std_msgs/Float64MultiArray: of our telemetry, the tick."""
    builder = CdrBuilder()
    builder.uint32(len(message.layout.dim))
    for dimension in message.layout.dim:
        builder.string(dimension.label)
        builder.uint32(dimension.size)
        builder.uint32(dimension.stride)
    builder.uint32(message.layout.data_offset)
    slot = builder.float64_sequence_slot(len(message.data))
    if not slot.count:
        raise MessageError(f"{topics.TELEMETRY.name}: no tick")
    return Layout.of(builder.build(), [Slot(slot.offset, 1)], [0])
