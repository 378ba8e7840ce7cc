"""The files of ``config/``, by name or by path, and the trees of settings that they hold."""

from __future__ import annotations

import os.path
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

from ..errors import InputError
from .installation import config_directory
from .text import choices, printable
from .validation import read_yaml, short
from .yaml_text import check_readable

Tree = dict[str, Any]
"""Nested settings."""

GIVEN = "given"
"""In place of a file's name: there is no file, all values are set directly."""

QOS_OVERRIDES = "qos_overrides."
"""Beginning of the names of ROS parameters for QoS policies."""


def is_of_ros(parameter: str) -> bool:
    """Return True for a parameter that rclpy declares for every node, by its dotted name."""
    names = ("use_sim_time", "start_type_description_service")
    return parameter in names or parameter.startswith(QOS_OVERRIDES)


def named_file(kind: str, name: str) -> Path:
    """Return ``config/<kind>/<name>.yaml``, or ``name`` itself if it is a path to a YAML file.

    Raises:
        InputError: there is no such file; lists the existing ones.
    """
    if name.endswith((".yaml", ".yml")):
        path = Path(name)
        check_readable(path)
        return path
    folder = config_directory() / kind
    if not is_named(kind, name):
        names = sorted(file.stem for file in folder.glob("*.yaml"))
        raise InputError(
            f"unknown {kind.rstrip('s')} {short(name)}: "
            f"{choices(name, names, ', or a path to a .yaml file')}"
        )
    return folder / f"{name}.yaml"


def is_named(kind: str, name: str) -> bool:
    """Return True if there is a file ``config/<kind>/<name>.yaml``."""
    # not Path.is_file, which raises an OSError if a name is too long
    return "/" not in name and os.path.isfile(config_directory() / kind / f"{name}.yaml")


def named_layers(kind: str, name: str) -> list[Path]:
    """Return the `named_file` in a list; an empty list for `GIVEN`."""
    return [] if name == GIVEN else [named_file(kind, name)]


def node_parameters(path: Path, node: str, namespace: str = "/") -> Tree:
    """Read the parameters of a node from a ROS parameter file, as a tree.

    They are below ``/**``, the node's ROS name, ``/**/`` and it, or the name in ``namespace``.
    """
    names, merged = ("**", f"{node}_node", f"{namespace.strip('/')}/{node}_node"), Tree()
    for name, content in read_yaml(path).items():
        if not isinstance(content, dict) or list(content) != ["ros__parameters"]:
            raise InputError(
                f"{path}: {name}: 'ros__parameters' was expected below the node's name"
            )
        parameters = content["ros__parameters"] or {}
        if not isinstance(parameters, dict):
            raise InputError(f"{path}: {name}: parameters were expected, got {short(parameters)}")
        if str(name).strip("/").removeprefix("**/") in names:
            merged = merge(merged, nest(parameters))
    return merged


def merge(below: Tree, above: Mapping[str, Any]) -> Tree:
    """Return ``below`` with its leaves overridden by those of ``above``."""
    merged = dict(below)
    for key, value in above.items():
        old = merged.get(key)
        both = isinstance(old, dict) and isinstance(value, Mapping)
        merged[key] = merge(old, value) if both else value  # type: ignore[arg-type]
    return merged


def nest(flat: Mapping[Any, Any]) -> Tree:
    """Convert ``{"a.b": 1}`` to ``{"a": {"b": 1}}``."""
    tree: Tree = {}
    for key, value in flat.items():
        head, _, rest = str(key).partition(".")
        inner = nest({rest: value}) if rest else nest(value) if isinstance(value, dict) else value
        _refuse_both(tree, {head: inner})
        tree = merge(tree, {head: inner})
    return tree


def _refuse_both(one: Tree, other: Tree, prefix: str = "") -> None:
    for key in one.keys() & other.keys():
        first, second = one[key], other[key]
        if isinstance(first, dict) is not isinstance(second, dict):
            name = printable(f"{prefix}{key}")
            raise InputError(f"{name}: given as a value, and as a group of values")
        if isinstance(first, dict):
            _refuse_both(first, second, f"{prefix}{key}.")


def flatten(tree: Mapping[Any, Any], prefix: str = "") -> Iterator[tuple[str, Any]]:
    """Yield ``("a.b", 1)`` for each leaf of ``{"a": {"b": 1}}``; an empty mapping is a leaf."""
    for key, value in tree.items():
        if isinstance(value, Mapping) and value:
            yield from flatten(value, f"{prefix}{key}.")
        else:
            yield f"{prefix}{key}", value
