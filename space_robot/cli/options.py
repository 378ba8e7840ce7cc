"""Options that say what to fly, the same for every command."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from ..flight.plan import Flight

Decorator = Callable[[Any], Any]
NODES = ("plant", "controller", "mission", "recorder")
_SCENARIO_PARAMETERS = f"{__name__}.parameters"
"""Key of a scenario's parameters in the context's ``meta``."""


def _parameters(
    context: click.Context, option: click.Parameter, given: Any
) -> dict[str, dict[str, Any]]:
    """``plant.hold_ticks=40`` to ``{"plant": {"hold_ticks": 40}}``, over the scenario's."""
    tree: dict[str, dict[str, Any]] = context.meta.pop(_SCENARIO_PARAMETERS, {})
    for text in given:
        _set(tree, text, "--set")
    return tree


def _set(tree: dict[str, dict[str, Any]], text: str, where: str) -> None:
    """Put ``plant.hold_ticks=40`` into ``tree``."""
    from space_robot_msgs_py.config.trees import flatten
    from space_robot_msgs_py.config.validation import one_of, short
    from space_robot_msgs_py.config.yaml_text import YamlTextError, parse_yaml
    from space_robot_msgs_py.errors import InputError

    name, equals, value = text.partition("=")
    node, _, parameter = name.partition(".")
    if not (equals and parameter):
        raise InputError(f"{where} {short(text)}: NODE.PARAM=VALUE expected")
    one_of(node, NODES, "node", f" in {where} {short(text)}")
    try:
        parsed = parse_yaml(value)
    except YamlTextError as error:
        raise InputError(f"{where} {short(name)}: {error}") from None
    tree.setdefault(node, {}).update(flatten({parameter: parsed}))


def _scenario(context: click.Context, option: click.Parameter, path: Path | None) -> None:
    """Take a scenario's values as the options' defaults."""
    if path is None:
        return
    from space_robot_msgs_py.config.validation import one_of, read_yaml

    options = {
        parameter.name: parameter
        for parameter in context.command.params
        if parameter.name and parameter.name not in ("scenario", "help")
    }
    content = read_yaml(path)
    for key in content:
        one_of(key, options, "key", f" in {path}")
    if (parameters := content.pop("parameters", None)) is not None:
        context.meta[_SCENARIO_PARAMETERS] = _scenario_parameters(parameters, str(path))
    values = {k: _scenario_value(options[k], v, f"{path}: {k}") for k, v in content.items()}
    context.default_map = {**(context.default_map or {}), **values}


def _scenario_parameters(given: Any, where: str) -> dict[str, dict[str, Any]]:
    """``parameters`` of a scenario: by node and name, or as ``--set`` has them."""
    from space_robot_msgs_py.config.trees import flatten, nest
    from space_robot_msgs_py.config.validation import one_of, short
    from space_robot_msgs_py.errors import InputError

    tree: dict[str, dict[str, Any]] = {}
    if isinstance(given, list) and all(isinstance(text, str) for text in given):
        for text in given:
            _set(tree, text, f"{where}: parameters")
    elif isinstance(given, dict) and all(isinstance(values, dict) for values in given.values()):
        for node, values in given.items():
            one_of(node, NODES, "node", f" in {where}: parameters")
            tree[node] = dict(flatten(nest(values)))
    else:
        raise InputError(
            f"{where}: parameters: a mapping of nodes to their parameters was expected, "
            f"got {short(given)}"
        )
    return tree


def _scenario_value(option: click.Parameter, value: Any, where: str) -> Any:
    """Return a scenario's value, if it is of the type that its option takes.

    Raises:
        InputError: it is of another.
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
        wanted, fits = "a text", is_number or (isinstance(value, str) and "\0" not in value)
        value = str(value) if is_number else value
    if not fits:
        raise InputError(f"{where}: {wanted} was expected, got {short(value)}")
    return value


def _remap(context: click.Context, option: click.Parameter, given: Any) -> dict[str, str]:
    """``/arm/states:=/joint_states`` to ``{"/arm/states": "/joint_states"}``."""
    from space_robot_msgs_py.config.validation import one_of
    from space_robot_msgs_py.topics import BY_NAME

    remap = {}
    for text in given:
        theirs, sign, ours = text.partition(":=")
        if not (theirs and sign and ours):
            raise click.BadParameter(
                f"{text!r}: THEIRS:=OURS expected, as /arm/states:=/joint_states"
            )
        remap[theirs] = one_of(ours, BY_NAME, "topic", f" in --remap {text}")
    return remap


def folder_option(name: str, help: str) -> Decorator:
    """Make an option that names a folder to write to."""
    kind = click.Path(path_type=Path, file_okay=False)
    return click.option(name, type=kind, metavar="DIR", help=help)


def file_option(*names: str, help: str) -> Decorator:
    """Make an option that names a file to write."""
    kind = click.Path(path_type=Path, dir_okay=False)
    return click.option(*names, type=kind, metavar="FILE", help=help)


REMAP = click.option(
    "--remap",
    multiple=True,
    callback=_remap,
    metavar="THEIRS:=OURS",
    help="Take their topic for ours, as /arm/states:=/joint_states; may be repeated.",
)

NAMESPACE = click.option(
    "--namespace",
    metavar="NS",
    help="Of the robot, as /sat1, where a bag has several [default: the only one].",
)

TRUST = click.option(
    "--trust",
    is_flag=True,
    help="Import the law and read the files that the bag names: runs the bag's code.",
)


def _list_faults(
    context: click.Context, option: click.Parameter, given: Sequence[str]
) -> Sequence[str]:
    if list(given) == ["list"]:
        from space_robot_sim.faults.grammar import help_lines

        from ..scenario.faults import KINDS

        click.echo("\n".join(help_lines(KINDS)))
        context.exit()
    return given


def _robot_options(function: Any) -> Any:
    """Give a command --robot, with --base and --repair, which are a part of a URDF's name."""

    @functools.wraps(function)
    def with_choice_of_urdf(*args: Any, base: str | None, repair: bool, **options: Any) -> Any:
        if base or repair:
            from space_robot_model.robot.choice import with_choice

            options["robot"] = with_choice(options["robot"], base, repair)
        return function(*args, **options)

    for option in (REPAIR, BASE, ROBOT):
        option(with_choice_of_urdf)
    return with_choice_of_urdf


ROBOT = click.option(
    "--robot",
    default="paper",
    show_default=True,
    help="paper, seven_joint, dual_arm, flexible_panels, boom, ets_vii, or a path to a robot's "
    "YAML, URDF or folder.",
)
BASE = click.option("--base", metavar="LINK", help="The satellite, of a URDF [default: its root].")
REPAIR = click.option(
    "--repair", is_flag=True, help="Repair the defects of a URDF that can be; each is told."
)

OPTIONS: dict[str, Decorator] = {
    "controller": click.option(
        "--controller",
        default="tde_stc",
        show_default=True,
        help="ctc, ctc_smc, tde_smc, tde_tsmc, tde_stc, or file.py:Class of your own.",
    ),
    "case": click.option(
        "--case",
        default="1",
        show_default=True,
        help="1, 2, 3, 4-1, 4-2, or a path to a case's YAML.",
    ),
    "sensors": click.option(
        "--sensors",
        default="ideal",
        show_default=True,
        help="ideal, fine, tactical, coarse, white_l1, white_l2, or a path to a YAML file.",
    ),
    "actuators": click.option(
        "--actuators",
        default="ideal",
        show_default=True,
        help="Of the base: ideal, none (it floats freely), wheels, small_wheels, thrusters, "
        "wheels_and_thrusters, or a path to a YAML file.",
    ),
    "gains": click.option(
        "--gains",
        default="default",
        show_default=True,
        help="printed, tuned, robust, default (printed where it flies), or a path.",
    ),
    "robot": _robot_options,
    "mission": click.option(
        "--mission", default="", help="Mission by name or path [default: the robot's]."
    ),
    "duration": click.option(
        "--duration", type=float, help="Seconds to fly [default: the mission's]."
    ),
    "period": click.option(
        "--period",
        type=float,
        help="Length of a tick, s, of the plant's and all other nodes [default: 0.0005].",
    ),
    "substeps": click.option(
        "--substeps", type=int, help="Integration steps of the plant in a tick [default: 1]."
    ),
    "bag": click.option(
        "--bag", type=click.Path(path_type=Path), help="Folder of the bag to write."
    ),
    "compression": click.option(
        "--compression",
        type=click.Choice(["none", "lz4", "zstd"]),
        help="Of the bag [default: lz4].",
    ),
    "split_size": click.option(
        "--split-size",
        metavar="SIZE",
        help="Go on in another file of the bag after so many bytes, as 500K, 100M, 2G "
        "[default: one file].",
    ),
    "navigation": click.option(
        "--navigation",
        type=click.Choice(["direct", "filtered"]),
        help="What the laws see: measurements, or what the navigation filter makes of them "
        "[default: direct].",
    ),
    "latency": click.option(
        "--command-latency-ticks",
        type=int,
        default=0,
        show_default=True,
        help="Ticks by which the plant applies commands late.",
    ),
    "friction": click.option(
        "--friction/--no-friction",
        default=True,
        show_default=True,
        help="Joint friction of the case, or none.",
    ),
    "swap": click.option(
        "--swap",
        "swaps",
        multiple=True,
        metavar="T:LAW",
        help="Swap to LAW at T simulated seconds; may be repeated.",
    ),
    "fault": click.option(
        "--fault",
        "faults",
        multiple=True,
        metavar="KIND@T[-END][:ARG]",
        callback=_list_faults,
        help="Inject a fault at T simulated seconds; may be repeated; --fault list lists all "
        "kinds.",
    ),
    "event": click.option(
        "--event",
        "events",
        multiple=True,
        metavar="capture@T:TARGET|release@T[:SPEED]",
        help="Capture a target (of config/targets, or a path to its YAML) or let it go at T "
        "simulated seconds; may be repeated [default: the mission's events].",
    ),
    "seed": click.option(
        "--seed", type=int, default=0, help="Seed of the random numbers of faults and sensors."
    ),
    "set": click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="NODE.PARAM=VALUE",
        callback=_parameters,
        help="Any parameter of a node, as plant.hold_ticks=40; may be repeated.",
    ),
    "scenario": click.option(
        "--scenario",
        type=click.Path(path_type=Path),
        is_eager=True,
        callback=_scenario,
        expose_value=False,
        help="YAML file with any of these options; those given here come first.",
    ),
    "json": click.option("--json", "as_json", is_flag=True, help="Print the report as JSON."),
}

GRAPH_OPTIONS: dict[str, Decorator] = {
    "realtime": click.option(
        "--realtime", is_flag=True, help="Pace by the wall clock instead of lockstep."
    ),
    "paused": click.option(
        "--paused",
        is_flag=True,
        help="Begin paused: `space-robot sim` lets the plant go on, or step.",
    ),
    "fifo_priority": click.option(
        "--fifo-priority",
        type=click.IntRange(0, 98),
        default=0,
        help="Ask for SCHED_FIFO for plant and controller; for machines with cores to spare.",
    ),
    "namespace": click.option(
        "--namespace",
        default="",
        metavar="NS",
        help="ROS namespace of the nodes and their topics, as /sat1: one for each robot of a "
        "domain.",
    ),
}
"""What only a graph of nodes has; its nodes may be started by `fly` or by a launch file."""


def flight_options(*names: str) -> Decorator:
    """Give a command the named options, in that order."""

    def decorate(function: Any) -> Any:
        for name in reversed(names):
            function = {**OPTIONS, **GRAPH_OPTIONS}[name](function)
        return function

    return decorate


def plan_flight(**options: Any) -> Flight:
    """Return the flight that a command's options ask for.

    Raises:
        InputError: they do not fit together, or name what there is not.
    """
    from space_robot_msgs_py.config.validation import validate

    from ..flight.plan import Flight, FlightPlan

    return Flight(validate(FlightPlan, options, "options"))


def remarks_on(flight: Flight) -> list[str]:
    """Return what there is to say of a flight before it begins.

    Of a robot's file that was repaired, of a start away from the mission's, of gains with too
    little margin (of default gains only where hardware or a fault tries the margin), of joints
    that are asked too much.
    """
    from ..flight.start_step import sentence
    from ..tuning.gain_check import pair_corner
    from ..tuning.warning import limit_remarks, margin_remarks

    flown = [flight.law, *(law for _, law in flight.swaps)]
    corner = pair_corner(flight.controller_settings)
    names = flight.plant.names
    # the default gains of an ideal plant are the project's own choice: nobody is warned of them
    tries_margin = flight.has_chosen_gains or bool(flight.faults) or bool(names.actuators)
    on_gains = margin_remarks(
        flown,
        flight.plant.robot,
        flight.mission_settings,
        corner,
        flight.controls_base,
        on_thrusters=bool(names.thrusters and not names.wheels),
        on_thin_margin=tries_margin,
    )
    on_limits = limit_remarks(flight.plant.robot, flight.mission_settings)
    step = flight.start_step
    on_start = [f"warning: {sentence(step)}"] if step else []
    repaired = [f"repaired: {text}" for text in flight.robot.repairs]
    return [*repaired, *on_start, *on_gains, *on_limits]


OUTPUT = file_option("--output", help="File to write the JSON to as well.")


def put_json(report: Any, as_json: bool, output: Path | None) -> None:
    """Write a report to ``output``, if given, and print it if JSON was asked for."""
    text = json.dumps(report, indent=1, allow_nan=False)
    if output:
        from ..console.files import whole_file

        with whole_file(output, replace=True) as file:
            file.write(text.encode() + b"\n")
    if as_json:
        click.echo(text)
