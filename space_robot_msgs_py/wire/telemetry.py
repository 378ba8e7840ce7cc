"""Conversion of what nodes send beside states and commands: reference, truth, telemetry, law, time.

None of it needs compiled code: it is not of every tick, or of many ticks at once.
"""

from __future__ import annotations

from collections.abc import Collection, Iterable, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .. import topics
from ..errors import MessageError
from ..samples import LawInForce, ReferenceChunk, RobotNames, RobotState, State, Timebase
from .cdr import MessageLayout
from .definitions import decode
from .messages import TELEMETRY_ROWS, Codec, describe

Array = NDArray[np.float64]
Messages = Iterable[tuple[topics.Topic, bytes]]

CHUNK_TICKS = 20
"""Ticks per message of the truth, hence the maximum number of ticks lost with a killed plant."""
NODE = topics.LAW.full_name.rpartition("/")[0] + "_node"
"""Full name of the controller's node in the root namespace."""
CONTROLLER = "controller"
"""Parameter with the name of the law."""
STRING, DOUBLE_ARRAY = 4, 8
"""Constants of rcl_interfaces/ParameterType."""
NO_NAMES = RobotNames(())


class ReferenceCodec:
    """Converts `ReferenceChunk` to its two messages and back.

    The length of messages may vary; a constant length is fastest.
    """

    def __init__(self, joint_names: Sequence[str], timebase: Timebase) -> None:
        self._n, self._timebase = len(joint_names), timebase
        self._joints = Codec(describe(topics.REFERENCE_JOINTS, joint_names, timebase))
        self._base = Codec(describe(topics.REFERENCE_BASE, NO_NAMES, timebase))

    def encode(self, chunk: ReferenceChunk) -> tuple[bytes, bytes]:
        """Return the bytes of /reference/joints and /reference/base."""
        stamp_ns = self._timebase.stamp_ns(chunk.start)
        joints, base = chunk.joints.reshape(-1), chunk.base.reshape(-1)
        return self._joints.encode(stamp_ns, joints), self._base.encode(stamp_ns, base)

    def decode_joints(self, data: bytes) -> tuple[int, Array]:
        """Return first tick and rows (k, 3, n) of a /reference/joints."""
        stamp_ns, values = self._joints.decode(data)
        return self._timebase.tick(stamp_ns), values.reshape(-1, 3, self._n)

    def decode_base(self, data: bytes) -> tuple[int, Array]:
        """Return first tick and rows (k, 10) of a /reference/base."""
        stamp_ns, values = self._base.decode(data)
        return self._timebase.tick(stamp_ns), values.reshape(-1, 10)


class TruthWriter:
    """Collects the true states of `CHUNK_TICKS` ticks for each message, to reduce the cost."""

    def __init__(
        self, names: RobotNames, timebase: Timebase, wanted: Collection[topics.Topic]
    ) -> None:
        """``wanted``: topics whose messages are to be written."""
        described = [describe(topic, names, timebase) for topic in wanted]
        self._codecs = [(description, Codec(description)) for description in described]
        self._timebase = timebase
        self._rows = np.empty(CHUNK_TICKS, State.dtype(len(names.joints)))
        self._numbers = self._rows.view(np.float64).reshape(CHUNK_TICKS, -1)
        self._start = self._count = 0

    def add(self, truth: RobotState) -> Messages:
        """Add the state of the next tick; return complete messages."""
        if not self._count:
            self._start = truth.tick
        self._numbers[self._count] = truth.numbers
        self._count += 1
        return self.flush() if self._count == CHUNK_TICKS else ()

    def flush(self) -> Messages:
        """Return messages of the remaining states."""
        rows, self._count = self._rows[: self._count], 0
        if not len(rows):
            return ()
        stamp_ns = self._timebase.stamp_ns(self._start)
        messages = []
        for description, codec in self._codecs:
            columns = [rows[c.name][:, c.first : c.first + c.length] for c in description.columns]
            values = np.concatenate(columns, axis=1).reshape(-1)
            messages.append((description.topic, codec.encode(stamp_ns, values)))
        return messages


class TelemetryCodec:
    """Converts the `TELEMETRY_ROWS` of a tick to /controller/telemetry and back."""

    def __init__(self, axis_names: Sequence[str]) -> None:
        self._codec = Codec(describe(topics.TELEMETRY, axis_names, Timebase(1)))
        self._numbers = np.zeros(1 + len(TELEMETRY_ROWS) * len(axis_names))
        self._rows = self._numbers[1:].reshape(len(TELEMETRY_ROWS), -1)

    def encode(self, tick: int, rows: Sequence[Array]) -> bytes:
        """Return the bytes of /controller/telemetry for the `TELEMETRY_ROWS`, (n+3,) each."""
        self._numbers[0] = tick
        for target, row in zip(self._rows, rows, strict=True):
            target[:] = row
        return self._codec.encode(0, self._numbers)

    @staticmethod
    def decode(data: bytes) -> tuple[int, Array]:
        """Return tick and rows (4, n+3)."""
        message = decode(data, topics.TELEMETRY.type)
        offset, shape = message.layout.data_offset, [dim.size for dim in message.layout.dim]
        try:
            return int(message.data[0]), message.data[offset:].reshape(shape)
        except (IndexError, ValueError, OverflowError) as error:
            raise MessageError(f"{topics.TELEMETRY.full_name}: {error}") from None


class SignalsCodec:
    """Encodes telemetry by names of the axes, for external plotting tools."""

    def __init__(self, axis_names: Sequence[str], timebase: Timebase) -> None:
        self._codec = Codec(describe(topics.SIGNALS, axis_names, timebase))
        self._timebase = timebase

    def encode(self, tick: int, e: Array, s: Array, n_hat: Array) -> bytes:
        """Return the bytes for the signals (n+3,) of a tick."""
        values = np.concatenate((e, s, n_hat))
        return self._codec.encode(self._timebase.stamp_ns(tick), values)


class LawCodec:
    """Converts `LawInForce` to the parameters ``controller`` and ``<law>.<gain>``, and back.

    They are ``new_parameters`` for the initial law of a controller, ``changed_parameters`` for
    every other. Changes are rare, so the layout of each message is computed again.
    """

    def __init__(self, timebase: Timebase, node: str = NODE) -> None:
        """Create the codec; ``node`` is the full name of the controller node."""
        self._timebase, self._node = timebase, node

    def encode(self, law: LawInForce) -> bytes:
        """Return the bytes of /controller/law."""
        sec, nanosec = divmod(self._timebase.stamp_ns(law.tick), 1_000_000_000)
        values: dict[str, dict[str, Any]] = {
            CONTROLLER: {"type": STRING, "string_value": law.name}
        } | {
            f"{law.name}.{gain}": {"type": DOUBLE_ARRAY, "double_array_value": numbers}
            for gain, numbers in law.gains.items()
        }
        parameters = [{"name": name, "value": value} for name, value in values.items()]
        content = {
            "stamp": {"sec": sec, "nanosec": nanosec},
            "node": self._node,
            "new_parameters" if law.is_first else "changed_parameters": parameters,
        }
        return MessageLayout(topics.LAW.type, content).data

    @staticmethod
    def decode(data: bytes, tick: int) -> LawInForce:
        """Return the law of a message with the stamp of ``tick``.

        Raises:
            MessageError: the message has no law, or a gain that is not a list of numbers.
        """
        message = decode(data, topics.LAW.type)
        parameters = {
            p.name: p.value for p in (*message.new_parameters, *message.changed_parameters)
        }
        law = parameters.get(CONTROLLER)
        if law is None or law.type != STRING:
            raise MessageError(f"{topics.LAW.full_name}: no parameter {CONTROLLER!r}")
        name, gains = law.string_value, {}
        for key, value in parameters.items():
            if key.startswith(f"{name}."):
                if value.type != DOUBLE_ARRAY:
                    raise MessageError(f"{topics.LAW.full_name}: {key} is not a list of numbers")
                gains[key.removeprefix(f"{name}.")] = tuple(value.double_array_value.tolist())
        is_first = any(p.name == CONTROLLER for p in message.new_parameters)
        return LawInForce(tick, name, gains, is_first)


class ClockCodec:
    """Encodes /clock, which has only a stamp."""

    def __init__(self) -> None:
        self._codec = Codec(describe(topics.CLOCK, NO_NAMES, Timebase(1)))
        self._nothing = np.empty(0)

    def encode(self, stamp_ns: int) -> bytes:
        """Return the bytes of /clock."""
        return self._codec.encode(stamp_ns, self._nothing)
