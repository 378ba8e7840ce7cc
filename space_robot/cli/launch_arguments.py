"""The arguments of launch/fly.launch.py: the options of `space-robot fly`, under ROS's names.

`--command-latency-ticks 2` is `command_latency_ticks:=2`. So a launched flight is checked,
described in its bag, and the same to the last bit as one of the command.
"""

from __future__ import annotations

import shlex
from collections.abc import Iterable, Mapping, Sequence
from difflib import get_close_matches
from pathlib import Path
from typing import Any, NamedTuple

import click
from click.core import ParameterSource

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..flight.plan import Flight
from ..scenario.objects import NODES
from ..scenario.options import OPTIONS
from .options import flight_options, plan_flight

PARAMS_FILE = "params_file"
"""Argument for a ROS parameter file, as launch files name it; not an option of `fly`."""
PACKAGE = "space_robot"
"""Package that `ros2 launch` is given before the name of a launch file."""


class LaunchArgument(NamedTuple):
    """An argument as launch declares it."""

    name: str
    description: str
    choices: tuple[str, ...] = ()
    """Allowed values; empty: any text."""
    default: str = ""
    """Default of the option, for the reader; empty: none."""


class LaunchedFlight(NamedTuple):
    """Flight to be launched."""

    flight: Flight
    bag: Path
    ros_parameters: dict[str, dict[str, Any]]
    """Parameters by node that every ROS node has, from the parameter file."""


@click.command()
@flight_options(
    *(name for name, option in OPTIONS.items() if option.is_launched), *("bag", "set", "scenario")
)
@click.pass_context
def _plan(
    context: click.Context,
    /,
    bag: Path | None,
    namespace: str,
    parameters: dict[str, dict[str, Any]],
    **options: Any,
) -> LaunchedFlight:
    from space_robot_msgs_py.config.files import merge

    from ..flight.flight_messages import default_bag

    group, file = context.obj
    if context.get_parameter_source("namespace") is ParameterSource.DEFAULT:
        namespace = ""
    if not namespace.startswith("/"):  # as a node's in a launch file
        namespace = f"{group}/{namespace}"
    own, ros_parameters = _file_parameters(file, namespace)
    flight = plan_flight(namespace=namespace, parameters=merge(parameters, own), **options)
    return LaunchedFlight(flight, bag or default_bag(flight), ros_parameters)


def launch_arguments() -> list[LaunchArgument]:
    """Return the arguments; each may be left empty, for the option's default."""
    options = [option for option in _plan.params if isinstance(option, click.Option)]
    file_argument = LaunchArgument(
        PARAMS_FILE, "ROS parameter file for the nodes, over all the rest."
    )
    return [*(_argument(option) for option in options), file_argument]


def _argument(option: click.Option) -> LaunchArgument:
    help_ = " ".join((option.help or "").split())
    description, separator, default = help_.removesuffix("].").partition(" [default: ")
    if separator:
        description += "."
    elif option.is_flag:
        default = str(option.default is True).lower()
    elif option.show_default:
        default = str(option.default)
    choices: tuple[str, ...] = ()
    if option.multiple:
        description += " Separate several with spaces."
    elif option.is_flag:
        choices = ("", "true", "false")
    elif isinstance(option.type, click.Choice):
        choices = ("", *option.type.choices)
    return LaunchArgument(_name(option), description, choices, default)


def _name(option: click.Option) -> str:
    return max(option.opts, key=len).lstrip("-").replace("-", "_")


def refuse_unknown(command_line: Sequence[str], file: str, names: Iterable[str]) -> None:
    """Check that a launch file is not started with an unknown argument.

    launch itself takes any. Arguments of another launch file that includes this one are that one's
    own, whatever its name.

    Args:
        command_line: of the process, as ``ros2 launch space_robot fly.launch.py case:=1``.
        file: path of the launch file.
        names: its arguments.

    Raises:
        InputError: an argument is unknown.
    """
    own, words = Path(file), list(command_line)
    before = ""
    while words:
        is_named = (before, words[0]) == (PACKAGE, own.name)
        before = words.pop(0)
        if is_named or (before.endswith(own.name) and Path(before).resolve() == own.resolve()):
            break
    known = list(names)
    for word in words:
        name, is_argument, _ = word.partition(":=")
        if is_argument and name not in known:
            near = get_close_matches(name, known, n=1)
            meant = f"did you mean {near[0]}? " if near else ""
            raise InputError(
                f"{Path(file).name}: unknown argument {short(name)}: "
                f"{meant}--show-args lists all arguments"
            )


def launched_flight(values: Mapping[str, str], group: str = "") -> LaunchedFlight:
    """Return the flight that a launch file's arguments ask for, checked as `fly` does.

    Args:
        values: of each argument, by name; empty for its default.
        group: namespace of the group that includes the launch file; a relative one is in it.

    Raises:
        InputError: values conflict, a name is unknown, or one needs `space-robot fly`.
    """
    chosen: dict[str, Any] = {}
    for option in _plan.params:
        if isinstance(option, click.Option) and (text := values.get(_name(option), "")):
            chosen[str(option.name)] = shlex.split(text) if option.multiple else text
    about = group, values.get(PARAMS_FILE, "")
    try:
        launched: LaunchedFlight = _plan.main(
            [], "fly.launch.py", standalone_mode=False, obj=about, default_map=chosen
        )
    except click.ClickException as error:
        raise InputError(error.format_message()) from None
    if faults := launched.flight.scenario.process_faults:
        raise InputError(f"fault {faults[0]}: that needs `space-robot fly`")
    return launched


def _file_parameters(
    file: str, namespace: str
) -> tuple[dict[str, dict[str, Any]], dict[str, dict[str, Any]]]:
    """Return the parameters of a ROS parameter file by node: those of the flight, and ROS's own."""
    from space_robot_msgs_py.config.files import flatten, is_of_ros, node_parameters

    own: dict[str, dict[str, Any]] = {}
    ros_parameters: dict[str, dict[str, Any]] = {node: {} for node in NODES}
    for node in NODES if file else ():
        for name, value in flatten(node_parameters(Path(file), node, namespace)):
            (ros_parameters if is_of_ros(name) else own).setdefault(node, {})[name] = value
    return own, ros_parameters
