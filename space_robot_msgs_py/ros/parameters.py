"""A settings schema as declared ROS parameters: one source for names, ranges, descriptions."""

from __future__ import annotations

from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.exceptions import InvalidParameterTypeException, InvalidParameterValueException
from rclpy.node import Node

from ..configuration import NodeSettings, flatten, leaves, nest
from ..errors import InputError
from ..validation import check

Schema = TypeVar("Schema", bound=NodeSettings)


def _bounds(field: Any) -> tuple[float | None, float | None]:
    low = high = None
    for item in field.metadata:
        low = next((getattr(item, k) for k in ("ge", "gt") if hasattr(item, k)), low)
        high = next((getattr(item, k) for k in ("le", "lt") if hasattr(item, k)), high)
    return low, high


def descriptor(field: Any, read_only: bool) -> ParameterDescriptor:
    """Description and range of a schema's field."""
    low, high = _bounds(field)
    result = ParameterDescriptor(description=field.description or "", read_only=read_only)
    if low is not None and high is not None:
        if field.annotation is int:
            result.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=0)]
        else:
            result.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
            ]
    return result


def declare(node: Node, name: str, default: Any, description: ParameterDescriptor) -> Any:
    """Declare one parameter and return its value (the user's override, or the default).

    Raises:
        InputError: the override has the wrong type or is out of range.
    """
    try:
        return node.declare_parameter(name, default, description).value
    except (InvalidParameterTypeException, InvalidParameterValueException) as error:
        raise InputError(f"{node.get_name()} parameters: {name}: {error}") from None


def declare_settings(
    node: Node, schema: type[Schema], changeable: tuple[str, ...] = ()
) -> Schema:
    """Declare every setting of ``schema`` and return their values.

    The selectors come first: they name the files that hold the defaults of the rest. All are
    read-only but the ``changeable`` ones.

    Raises:
        InputError: a file or an override is wrong.
    """
    fields = dict(leaves(schema))
    overrides = node._parameter_overrides
    base = schema.resolve({k: overrides[k].value for k in schema.selectors if k in overrides})
    values = {}
    for name, default in flatten(base.model_dump()):
        description = descriptor(fields[name], name not in changeable)
        # an empty array has no type of its own in ROS
        values[name] = declare(node, name, default or [""] if default == [] else default, description)
    return check(schema, nest({k: _plain(v) for k, v in values.items()}), _where(node))


def refuse_unknown(node: Node) -> None:
    """Stop on a parameter nobody declared, which ROS would ignore in silence.

    Raises:
        InputError: naming the parameter and those there are.
    """
    allowed = sorted(node._parameters)
    for name in node._parameter_overrides:
        if name not in allowed and not name.startswith("qos_overrides."):
            raise InputError(
                f"{_where(node)}: unknown parameter {name!r}: choose one of {', '.join(allowed)}"
            )


def _plain(value: Any) -> Any:
    return list(value) if hasattr(value, "typecode") else value


def _where(node: Node) -> str:
    return f"{node.get_name()} parameters"
