"""The options ``--scenario`` and ``--set``: scenario file and single node parameters."""

from __future__ import annotations

from collections.abc import Collection
from pathlib import Path
from typing import Any

import click

NODES = ("plant", "controller", "mission", "recorder")
_SCENARIO_PARAMETERS = f"{__name__}.parameters"
"""Key of a scenario's parameters in the context's ``meta``."""


class NameOrNumbers(click.ParamType[Any]):
    """A name or a path; in a scenario file also a mapping of the numbers."""

    name = "text"

    def convert(
        self, value: Any, param: click.Parameter | None, context: click.Context | None
    ) -> Any:
        """Return the value unchanged."""
        return value


def parameters(
    context: click.Context, option: click.Parameter, texts: Any
) -> dict[str, dict[str, Any]]:
    """``plant.hold_ticks=40`` to ``{"plant": {"hold_ticks": 40}}``, over the scenario's."""
    tree: dict[str, dict[str, Any]] = context.meta.pop(_SCENARIO_PARAMETERS, {})
    for text in texts:
        _set(tree, text, "--set")
    return tree


def _set(tree: dict[str, dict[str, Any]], text: str, where: str) -> None:
    """Put ``plant.hold_ticks=40`` into ``tree``."""
    from space_robot_msgs_py.config.files import flatten
    from space_robot_msgs_py.config.validation import one_of, short
    from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
    from space_robot_msgs_py.errors import InputError

    name, equals, value = text.partition("=")
    node, _, parameter = name.partition(".")
    if not (equals and parameter):
        raise InputError(
            f"{where} {short(text)}: NODE.PARAM=VALUE expected, as in plant.hold_ticks=40"
        )
    one_of(node, NODES, "node", f" in {where} {short(text)}")
    try:
        parsed = parse_yaml(value)
    except YamlTextError as error:
        raise InputError(f"{where} {short(name)}: {error}") from None
    tree.setdefault(node, {}).update(flatten({parameter: parsed}))


def scenario(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    """Use the values of a scenario as defaults of the options."""
    _use(context, path, ())


def scenario_of_flight(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    """Do the same for a command without some options of a flight, which are ignored."""
    from ..scenario.option_table import names

    _use(context, path, set(names()))


def _use(context: click.Context, path: Path | None, ignored: Collection[str]) -> None:
    if path is None:
        return
    from space_robot_msgs_py.config.validation import one_of, read_yaml

    options = {
        parameter.name: parameter
        for parameter in context.command.params
        if parameter.name and parameter.name not in ("scenario", "help")
    }
    content = {k: v for k, v in read_yaml(path).items() if k in options or k not in ignored}
    for key in content:
        one_of(key, options, "key", f" in {path}")
    if (parameters := content.pop("parameters", None)) is not None:
        context.meta[_SCENARIO_PARAMETERS] = _scenario_parameters(parameters, str(path))
    values = {k: _scenario_value(options[k], v, f"{path}: {k}") for k, v in content.items()}
    context.default_map = {**(context.default_map or {}), **values}


def _scenario_parameters(content: Any, where: str) -> dict[str, dict[str, Any]]:
    """``parameters`` of a scenario: by node and name, or as ``--set`` has them."""
    from space_robot_msgs_py.config.files import flatten, nest
    from space_robot_msgs_py.config.validation import one_of, short
    from space_robot_msgs_py.errors import InputError

    tree: dict[str, dict[str, Any]] = {}
    if isinstance(content, list) and all(isinstance(text, str) for text in content):
        for text in content:
            _set(tree, text, f"{where}: parameters")
    elif isinstance(content, dict) and all(isinstance(values, dict) for values in content.values()):
        for node, values in content.items():
            one_of(node, NODES, "node", f" in {where}: parameters")
            tree[node] = dict(flatten(nest(values)))
    else:
        raise InputError(
            f"{where}: parameters: a mapping of nodes to their parameters was expected, "
            f"got {short(content)}"
        )
    return tree


def _scenario_value(option: click.Parameter, value: Any, where: str) -> Any:
    """Return a value of a scenario after checking its type.

    Raises:
        InputError: the type does not fit the option.
    """
    from space_robot_msgs_py.config.validation import short
    from space_robot_msgs_py.errors import InputError

    is_number = isinstance(value, (int, float)) and not isinstance(value, bool)
    if getattr(option, "multiple", False):
        wanted = "a list of texts"
        fits = isinstance(value, list) and all(isinstance(text, str) for text in value)
    elif isinstance(option.type, click.types.BoolParamType):
        wanted, fits = "true or false", isinstance(value, bool)
    elif isinstance(option.type, click.types.IntParamType):
        wanted, fits = "a whole number", is_number and isinstance(value, int)
    elif isinstance(option.type, click.types.FloatParamType):
        wanted, fits = "a number", is_number
    else:  # a number may stand for a name
        may_be_numbers = isinstance(option.type, NameOrNumbers)
        wanted = "a text or a mapping of numbers" if may_be_numbers else "a text"
        fits = is_number or (isinstance(value, str) and "\0" not in value)
        fits = fits or (may_be_numbers and isinstance(value, dict))
        value = str(value) if is_number else value
    if not fits:
        raise InputError(f"{where}: {wanted} was expected, got {short(value)}")
    return value
