"""Options that say what to fly, the same for every command."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Any], Any]
NODES = ("plant", "controller", "mission", "recorder")


def _parameters(
    context: click.Context, option: click.Parameter, given: Any
) -> dict[str, dict[str, Any]]:
    """``plant.hold_ticks=40`` to ``{"plant": {"hold_ticks": 40}}``."""
    import yaml

    from space_robot_msgs_py.validation import one_of

    tree: dict[str, dict[str, Any]] = {}
    for text in given:
        name, equals, value = text.partition("=")
        node, _, parameter = name.partition(".")
        if not (equals and parameter):
            raise click.BadParameter(f"{text!r}: NODE.PARAM=VALUE expected")
        one_of(node, NODES, "node", f" in --set {text}")
        tree.setdefault(node, {})[parameter] = yaml.safe_load(value)
    return tree


def _scenario(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    """Take a scenario's values as the options' defaults."""
    if path is None:
        return
    from space_robot_msgs_py.configuration import flatten
    from space_robot_msgs_py.validation import one_of, read_yaml

    names = [parameter.name for parameter in context.command.params if parameter.name]
    content = read_yaml(path)
    for key in content:
        one_of(
            key, [name for name in names if name not in ("scenario", "help")], "key", f" in {path}"
        )
    if isinstance(parameters := content.get("parameters"), dict):
        content["parameters"] = [f"{k}={json.dumps(v)}" for k, v in flatten(parameters)]
    context.default_map = {**(context.default_map or {}), **content}


def _remap(context: click.Context, option: click.Parameter, given: Any) -> dict[str, str]:
    """``/arm/states:=/joint_states`` to ``{"/arm/states": "/joint_states"}``."""
    from space_robot_msgs_py.topics import BY_NAME
    from space_robot_msgs_py.validation import one_of

    remap = {}
    for text in given:
        theirs, sign, ours = text.partition(":=")
        if not (theirs and sign and ours):
            raise click.BadParameter(
                f"{text!r}: THEIRS:=OURS expected, as /arm/states:=/joint_states"
            )
        remap[theirs] = one_of(ours, BY_NAME, "topic", f" in --remap {text}")
    return remap


REMAP = click.option(
    "--remap", multiple=True, callback=_remap, metavar="THEIRS:=OURS",
    help="Take their topic for ours, as /arm/states:=/joint_states; may be repeated.",
)  # fmt: skip

TRUST = click.option(
    "--trust", is_flag=True,
    help="Import the module:Class and read the files that the bag names: runs the bag's code.",
)  # fmt: skip

OPTIONS: dict[str, Decorator] = {
    "controller": click.option(
        "--controller", default="tde_stc", show_default=True,
        help="ctc, ctc_smc, tde_smc, tde_tsmc, tde_stc, or module:Class of your own."),
    "case": click.option(
        "--case", default="1", show_default=True,
        help="1, 2, 3, 4-1, 4-2, or a path to a case's YAML."),
    "gains": click.option(
        "--gains", default="default", show_default=True,
        help="printed, tuned, default (printed where it flies), or a path."),
    "robot": click.option(
        "--robot", default="paper", show_default=True,
        help="paper, seven_joint, or a path to a robot's YAML."),
    "mission": click.option(
        "--mission", default="", help="Mission by name or path [default: the robot's]."),
    "duration": click.option(
        "--duration", type=float, help="Seconds to fly [default: the mission's]."),
    "bag": click.option(
        "--bag", type=click.Path(path_type=Path), help="Folder of the bag to write."),
    "compression": click.option(
        "--compression", type=click.Choice(["none", "lz4", "zstd"]),
        help="Of the bag [default: lz4]."),
    "split_size": click.option(
        "--split-size", metavar="SIZE",
        help="Go on in another file of the bag after so many bytes, as 500K, 100M, 2G "
        "[default: one file]."),
    "latency": click.option(
        "--command-latency-ticks", type=int, default=0, show_default=True,
        help="Ticks by which the plant applies commands late."),
    "friction": click.option(
        "--friction/--no-friction", default=True, show_default=True,
        help="Joint friction of the case, or none."),
    "swap": click.option(
        "--swap", "swaps", multiple=True, metavar="T:LAW",
        help="Swap to LAW at T simulated seconds; may be repeated."),
    "set": click.option(
        "--set", "parameters", multiple=True, metavar="NODE.PARAM=VALUE", callback=_parameters,
        help="Any parameter of a node, as plant.hold_ticks=40; may be repeated."),
    "scenario": click.option(
        "--scenario", type=click.Path(path_type=Path), is_eager=True, callback=_scenario,
        expose_value=False,
        help="YAML file with any of these options; those given here come first."),
    "json": click.option(
        "--json", "as_json", is_flag=True, help="Print the report as JSON."),
}  # fmt: skip


def flight_options(*names: str) -> Decorator:
    """Give a command the named options, in that order."""

    def decorate(function: Any) -> Any:
        for name in reversed(names):
            function = OPTIONS[name](function)
        return function

    return decorate


def check_writable(path: Path) -> None:
    """See that a file can be written, before any work is done for it.

    Raises:
        InputError: it cannot.
    """
    from space_robot_msgs_py.errors import InputError

    try:
        path.open("a", encoding="utf-8").close()
    except OSError as error:
        raise InputError(f"{path}: cannot be written ({error.strerror})") from None


OUTPUT = click.option(
    "--output", type=click.Path(path_type=Path, dir_okay=False), metavar="FILE",
    help="File to write the JSON to as well.",
)  # fmt: skip


def put_json(report: Any, as_json: bool, output: Path | None) -> None:
    """Write a report to ``output``, if given, and print it if JSON was asked for."""
    text = json.dumps(report, indent=1, allow_nan=False)
    if output:
        output.write_text(text + "\n", "utf-8")
    if as_json:
        click.echo(text)
