"""/controller/law: a message for each change of the law or its gains."""

from __future__ import annotations

from typing import Any

from .. import topics
from ..errors import MessageError
from ..samples import LawInForce, Timebase
from .cdr import MessageLayout
from .definitions import decode

NODE = topics.LAW.full_name.rpartition("/")[0] + "_node"
"""Full name of the node in the root namespace."""
CONTROLLER = "controller"
"""Parameter with the name of the law."""
STRING, DOUBLE_ARRAY = 4, 8
"""Constants of rcl_interfaces/ParameterType."""


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
