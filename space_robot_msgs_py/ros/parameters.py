"""A settings schema as declared ROS parameters: one source for names, ranges, descriptions."""

from __future__ import annotations

from collections.abc import Iterable
from typing import Any, TypeVar

from rcl_interfaces.msg import FloatingPointRange, IntegerRange, ParameterDescriptor
from rclpy.node import Node

from ..config.choices import choices
from ..config.settings import NodeSettings, leaves
from ..config.trees import flatten
from ..errors import InputError
from .rclpy_internals import declared_parameters, parameter_overrides

Schema = TypeVar("Schema", bound=NodeSettings)


def _bounds(field: Any) -> tuple[float | None, float | None]:
    low = high = None
    for item in field.metadata:
        low = next((getattr(item, k) for k in ("ge", "gt") if hasattr(item, k)), low)
        high = next((getattr(item, k) for k in ("le", "lt") if hasattr(item, k)), high)
    return low, high


def descriptor(field: Any, read_only: bool) -> ParameterDescriptor:
    """Return the ROS descriptor of a schema's field: description and range."""
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


def declare_settings(node: Node, schema: type[Schema], changeable: tuple[str, ...] = ()) -> Schema:
    """Resolve a schema from files and the user's parameters, and declare every setting.

    All are read-only except the ``changeable`` ones. The schema checks types and ranges first, with
    clearer messages than ROS.

    Raises:
        InputError: an invalid file or parameter.
    """
    fields = dict(leaves(schema))
    settings = schema.resolve(overrides(node, fields))
    usual = schema.model_fields["period"].default
    if settings.period != usual:
        node.get_logger().info(
            f"a tick lasts {settings.period:g} s; the shipped gains are for {usual:g} s"
        )
    for name, value in flatten(settings.model_dump()):
        node.declare_parameter(
            name, value, descriptor(fields[name], name not in changeable), ignore_override=True
        )
    return settings


def overrides(node: Node, names: Iterable[str]) -> dict[str, Any]:
    """Return the user's values of these parameters, from the command line or a file."""
    values = parameter_overrides(node)
    return {name: _plain(values[name].value) for name in names if name in values}


def refuse_unknown(node: Node) -> None:
    """Refuse undeclared parameters, which ROS would ignore silently.

    Raises:
        InputError: an unknown parameter; lists the existing ones.
    """
    allowed = sorted(declared_parameters(node))
    for name in parameter_overrides(node):
        if name not in allowed and not name.startswith("qos_overrides."):
            raise InputError(
                f"{node.get_name()} parameters: unknown parameter {name!r}: "
                f"{choices(name, allowed)}"
            )


def _plain(value: Any) -> Any:
    return list(value) if hasattr(value, "typecode") else value
