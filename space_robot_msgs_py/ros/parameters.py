"""A settings schema as declared ROS parameters: one source for names, ranges, descriptions."""

from __future__ import annotations

from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ..config.files import QOS_OVERRIDES, flatten
from ..config.settings import NodeSettings, leaves
from ..config.text import choices
from ..errors import InputError
from .rclpy_internals import declared_parameters, parameter_overrides

Schema = TypeVar("Schema", bound=NodeSettings)


def descriptor(field: Any, read_only: bool) -> ParameterDescriptor:
    """Return the ROS descriptor of a schema's field: description and range."""
    low = high = None
    for item in field.metadata:
        low = next((getattr(item, k) for k in ("ge", "gt") if hasattr(item, k)), low)
        high = next((getattr(item, k) for k in ("le", "lt") if hasattr(item, k)), high)
    result = ParameterDescriptor(description=field.description or "", read_only=read_only)
    if low is not None and high is not None:
        if field.annotation is int:
            result.integer_range = [IntegerRange(from_value=int(low), to_value=int(high), step=0)]
        else:
            result.floating_point_range = [
                FloatingPointRange(from_value=float(low), to_value=float(high), step=0.0)
            ]
    return result


def declare_settings(node: Node, schema: type[Schema], changeable: tuple[str, ...] = ()) -> Schema:
    """Resolve a schema from files and the user's parameters, and declare every setting.

    All are read-only except the ``changeable`` ones. The schema checks types and ranges first, with
    clearer messages than ROS.
    """
    fields = dict(leaves(schema))
    own = overrides(node)
    settings = schema.resolve({name: own[name] for name in fields if name in own})
    usual = schema.model_fields["period"].default
    if settings.period != usual:
        node.get_logger().info(
            f"a tick lasts {settings.period:g} s; the shipped gains are for {usual:g} s"
        )
    # the overrides are in these values already
    for name, value in flatten(settings.model_dump()):
        node.declare_parameter(
            name, value, descriptor(fields[name], name not in changeable), ignore_override=True
        )
    return settings


def overrides(node: Node) -> dict[str, Any]:
    """Return what the user gave for the node's parameters, on the command line or in a file.

    Overrides of QoS policies are not among them: rclpy declares these.
    """
    values = parameter_overrides(node)
    return {
        name: _plain(values[name].value) for name in values if not name.startswith(QOS_OVERRIDES)
    }


def refuse_unknown(node: Node) -> None:
    """Refuse undeclared parameters, which ROS would ignore silently."""
    allowed = sorted(declared_parameters(node))
    for name in overrides(node):
        if name not in allowed:
            raise InputError(
                f"{node.get_name()} parameters: unknown parameter {name!r}: "
                f"{choices(name, allowed)}"
            )


def _plain(value: Any) -> Any:
    # rclpy has lists of numbers as array.array
    return list(value) if hasattr(value, "typecode") else value
