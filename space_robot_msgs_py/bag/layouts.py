"""The numbers of many messages at once, whatever their layout.

The first message of a layout is decoded the general way; it tells where the numbers stand in all
that are laid out alike.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import Timebase
from ..wire.cdr import CdrBuilder, FixedMessage, Slot
from ..wire.decoded import name_order
from ..wire.definitions import decode
from .batch import Batch
from .kernels import Bytes, Integers, gather

Array = NDArray[np.float64]


class MessageLayout(NamedTuple):
    """Where a message's numbers stand, and which of them to take in which order."""

    layout: Bytes
    constant: Bytes
    runs: Integers
    order: NDArray[np.intp]

    @classmethod
    def of(
        cls, message: FixedMessage, slots: Sequence[Slot], order: Sequence[int]
    ) -> MessageLayout:
        """Of the numbers in ``slots``, one slot behind the other, those that ``order`` says."""
        runs = [message.run(slot) for slot in slots if slot.count]
        return cls(
            *message.pattern, np.array(runs, np.int64).reshape(-1, 2), np.array(order, np.intp)
        )


Describe = Callable[[Any], MessageLayout]
"""The layout of a decoded message; a `MessageError`: it does not fit."""


class FieldReader:
    """Takes the numbers out of the messages of a topic."""

    def __init__(self, type_name: str, describe: Describe) -> None:
        self._type, self._describe = type_name, describe
        self._layout: MessageLayout | None = None
        self.misfits = 0
        """Messages that could not be read."""
        self.fault = ""
        """Why the first of them could not."""

    def read(self, batch: Batch) -> Iterator[tuple[NDArray[np.intp], Array]]:
        """For each layout, the messages' places in the batch and their (M, width) numbers."""
        left = np.arange(len(batch))
        while len(left):
            if self._layout:
                fits, found = self._take(self._layout, batch, left)
                if fits.all():
                    yield left, found
                    return
                if fits.any():
                    yield left[fits], found[fits]
                    left = left[~fits]
            try:
                before, self._layout = self._layout, None
                self._layout = self._describe(decode(batch.message(left[0]), self._type))
                if not self._take(self._layout, batch, left[:1])[0][0]:
                    raise MessageError("its bytes are in another order")
            except MessageError as error:
                self.misfits += 1
                self.fault = self.fault or str(error)
                self._layout, left = before, left[1:]

    def _take(
        self, layout: MessageLayout, batch: Batch, left: NDArray[np.intp]
    ) -> tuple[NDArray[np.bool_], Array]:
        """Which of the messages ``left`` are laid out so, and a row of numbers for each."""
        found = np.empty((len(left), int(layout.runs[:, 1].sum()) // 8))
        fits = np.empty(len(left), np.bool_)
        gather(
            batch.data, batch.starts[left], batch.lengths[left], layout.layout, layout.constant,
            layout.runs, found.view(np.uint8), fits,
        )  # fmt: skip
        in_order = np.array_equal(layout.order, np.arange(found.shape[1]))
        return fits, found if in_order else found[:, layout.order]


def joint_states(topic: topics.Topic, names: Sequence[str], fields: Sequence[str]) -> Describe:
    """The ``fields`` of a sensor_msgs/JointState, one behind the other, each in order of names."""

    def describe(message: Any) -> MessageLayout:
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
        return MessageLayout.of(builder.build(), [slots[field] for field in fields], columns)

    return describe


def joint_trajectory(names: Sequence[str], timebase: Timebase) -> Describe:
    """Positions, velocities, accelerations of each point of a trajectory_msgs/JointTrajectory."""
    name = topics.REFERENCE_JOINTS.name

    def describe(message: Any) -> MessageLayout:
        order = name_order(message.joint_names, names, name)
        _check_spacing(message.points, timebase, name)
        builder = _begin(message)
        builder.uint32(len(message.points))
        slots = []
        for point in message.points:
            for values in (point.positions, point.velocities, point.accelerations):
                if len(values) != len(names):
                    raise MessageError(f"{name}: a point lacks values of some joint", "size")
                slots.append(builder.float64_sequence_slot(len(values)))
            builder.float64_sequence_slot(len(point.effort))
            _time_from_start(builder, point)
        columns = [i * len(names) + k for i in range(len(slots)) for k in order]
        return MessageLayout.of(builder.build(), slots, columns)

    return describe


def base_state(message: Any) -> MessageLayout:
    """A sensor_msgs/MultiDOFJointState of one body, in the order of the columns of a log.

    Position, quaternion w x y z, linear and angular velocity, torque.
    """
    name_order(message.joint_names, [topics.BASE_FRAME], topics.BASE_STATE.name)
    if not (len(message.transforms) == len(message.twist) == len(message.wrench) == 1):
        raise MessageError(f"{topics.BASE_STATE.name}: one transform, twist, wrench expected")
    builder = _begin(message)
    slots = _one_body(builder)
    columns = [0, 1, 2, 6, 3, 4, 5, *range(7, 13), *range(16, 19)]
    return MessageLayout.of(builder.build(), slots, columns)


def base_trajectory(timebase: Timebase) -> Describe:
    """Quaternion w x y z, angular velocity, acceleration of each point of the base's reference."""
    name = topics.REFERENCE_BASE.name

    def describe(message: Any) -> MessageLayout:
        name_order(message.joint_names, [topics.BASE_FRAME], name)
        _check_spacing(message.points, timebase, name)
        builder = _begin(message)
        builder.uint32(len(message.points))
        slots = []
        for point in message.points:
            if not len(point.transforms) == len(point.velocities) == len(point.accelerations) == 1:
                raise MessageError(f"{name}: a point lacks pose, velocity or acceleration", "size")
            slots += _one_body(builder)
            _time_from_start(builder, point)
        wanted = [6, 3, 4, 5, 10, 11, 12, 16, 17, 18]
        columns = [19 * i + k for i in range(len(message.points)) for k in wanted]
        return MessageLayout.of(builder.build(), slots, columns)

    return describe


def _one_body(builder: CdrBuilder) -> list[Slot]:
    """Sequences of one Transform (x y z, x y z w) and two of Twist or Wrench: 19 numbers."""
    slots = []
    for width in (7, 6, 6):
        builder.uint32(1)
        slots.append(builder.float64_slot(width))
    return slots


def _time_from_start(builder: CdrBuilder, point: Any) -> None:
    """As a constant: points that stand elsewhere in time are another layout."""
    builder.uint32(point.time_from_start.sec)
    builder.uint32(point.time_from_start.nanosec)


def _check_spacing(points: Sequence[Any], timebase: Timebase, topic: str) -> None:
    if not points:
        raise MessageError(f"{topic}: a trajectory without points")
    for i, point in enumerate(points):
        after = point.time_from_start
        if after.sec * 1_000_000_000 + after.nanosec != timebase.stamp_ns(i):
            raise MessageError(f"{topic}: point {i} is not {i} ticks after its message's stamp")


def first_number(message: Any) -> MessageLayout:
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
    return MessageLayout.of(builder.build(), [Slot(slot.offset, 1)], [0])


def _begin(message: Any) -> CdrBuilder:
    """Header and names, with which these messages begin."""
    builder = CdrBuilder()
    builder.header_slot(message.header.frame_id)
    builder.strings(message.joint_names)
    return builder
