"""Options that define a flight, shared by all commands."""

from __future__ import annotations

from collections.abc import Callable, Collection, Sequence
from functools import partial, wraps
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..scenario.options import OPTIONS
from .option_types import names_in

if TYPE_CHECKING:
    from space_robot_msgs_py.bag.flight_log import FlightLog

    from ..flight.plan import Flight
    from ..scenario.resolved import ResolvedScenario

Decorator = Callable[[Any], Any]


def _remap(context: click.Context, option: click.Parameter, texts: Any) -> dict[str, str]:
    from space_robot_msgs_py.config.validation import one_of
    from space_robot_msgs_py.topics import BY_NAME

    remap = {}
    for text in texts:
        theirs, sign, ours = text.partition(":=")
        if not (theirs and sign and ours):
            raise click.BadParameter(
                f"{text!r}: THEIRS:=OURS expected, as /arm/states:=/joint_states"
            )
        remap[theirs] = one_of(ours, BY_NAME, "topic", f" in --remap {text}")
    return remap


def folder_option(*names: str, help: str, **settings: Any) -> Decorator:
    """Make an option that names a folder to write to."""
    kind = click.Path(path_type=Path, file_okay=False)
    return click.option(*names, type=kind, metavar="DIR", help=help, **settings)


def file_option(*names: str, help: str) -> Decorator:
    """Make an option that names a file to write."""
    kind = click.Path(path_type=Path, dir_okay=False)
    return click.option(*names, type=kind, metavar="FILE", help=help)


def bag_options(function: Any) -> Any:
    """Give a command the options by which bags are read: --remap, --namespace and --trust."""
    for decorator in (
        click.option(
            "--trust",
            is_flag=True,
            help="Import the law and read the files that the bag names: runs the bag's code.",
        ),
        click.option(
            "--namespace",
            metavar="NS",
            help="Of the robot, as /sat1, where a bag has several [default: the only one].",
        ),
        click.option(
            "--remap",
            multiple=True,
            callback=_remap,
            metavar="THEIRS:=OURS",
            help="Take their topic for ours, as /arm/states:=/joint_states; may be repeated.",
        ),
    ):
        function = decorator(function)
    return function


def excerpt_options(function: Any) -> Any:
    """Give a command ``read``, which reads an excerpt of a bag as its options say."""

    @wraps(function)
    def command(
        *args: Any,
        from_s: float | None,
        to_s: float | None,
        remap: dict[str, str],
        namespace: str | None,
        trust: bool,
        **options: Any,
    ) -> Any:
        def read(bag: Path) -> FlightLog:
            from space_robot_msgs_py.bag.reader import read_flight

            from ..analysis import excerpt

            return excerpt(read_flight(bag, remap, trust, namespace), from_s, to_s)

        return function(*args, read=read, **options)

    begin = click.option(
        "--from", "from_s", type=float, metavar="T", help="Begin at T simulated seconds."
    )
    end = click.option(
        "--to", "to_s", type=float, metavar="T", help="End before T simulated seconds."
    )
    return begin(end(bag_options(command)))


def _list_faults(
    context: click.Context, option: click.Parameter, texts: Sequence[str]
) -> Sequence[str]:
    if list(texts) == ["list"] and not context.resilient_parsing:  # as completion parses
        from space_robot_sim.faults.grammar import help_lines

        from ..scenario.faults import KINDS

        click.echo("\n".join(help_lines(KINDS)))
        context.exit()
    return texts


def _robot_options(function: Any) -> Any:
    """Give a command --robot, with --base and --repair, which apply to a URDF."""

    @wraps(function)
    def with_urdf_choice(*args: Any, base: str | None, repair: bool, **options: Any) -> Any:
        if base or repair:
            from space_robot_model.robot.find import with_choice

            options["robot"] = with_choice(options["robot"], base, repair)
        return function(*args, **options)

    for decorator in (REPAIR, BASE, _click_option("robot")):
        decorator(with_urdf_choice)
    return with_urdf_choice


BASE = click.option("--base", metavar="LINK", help="The satellite, of a URDF [default: its root].")
REPAIR = click.option(
    "--repair", is_flag=True, help="Repair and list the repairable defects of a URDF."
)
WORKERS = click.option(
    "--workers",
    type=click.IntRange(0, 1024),
    help="Processes that fly; 0: this one alone [default: one a core].",
)


def _click_option(name: str) -> Decorator:
    option = OPTIONS[name]
    default, dashed = option.default, f"--{name.replace('_', '-')}"
    flag = dashed.removesuffix("s") if option.is_list else dashed
    settings: dict[str, Any] = {"help": option.help_text, "default": default}
    if option.choices:
        settings["type"] = click.Choice(option.choices)
    elif option.kind is Any:
        settings["type"] = click.UNPROCESSED  # in a scenario file also a mapping of numbers
    elif option.kind is int and option.high is not None:
        settings["type"] = click.IntRange(int(option.low or 0), int(option.high))
    elif option.kind is not bool:
        settings["type"] = option.kind
    if option.is_list:
        settings |= {"multiple": True, "default": None}
    elif option.kind is bool and default:
        flag = f"{dashed}/--no-{dashed[2:]}"
    elif option.kind is bool:
        settings["is_flag"] = True
    if option.metavar:
        settings["metavar"] = option.metavar
    if option.folder:
        settings["shell_complete"] = names_in(option.folder, [default] if default else [])
    if default or (option.kind is int and default is not None):
        settings["show_default"] = True
    if name == "faults":
        settings["callback"] = _list_faults
    return click.option(flag, name, **settings)


def _use_scenario(
    context: click.Context, option: click.Parameter, path: Path | None, ignored: Collection[str]
) -> None:
    """Use the values of a scenario file as defaults of a command's options."""
    if path is None:
        return
    from space_robot_msgs_py.config.validation import one_of, read_yaml, short, validate
    from space_robot_msgs_py.errors import InputError

    from ..scenario.scenario import Scenario

    names = (parameter.name for parameter in context.command.params)
    own = [name for name in names if name and name not in ("scenario", "help")]
    content = {k: v for k, v in read_yaml(path).items() if k in own or k not in ignored}
    for key, value in content.items():
        one_of(key, [*own, *ignored], "key", f" in {path}")
        is_text = isinstance(value, (str, int, float)) and "\0" not in str(value)
        if key not in Scenario.model_fields and not is_text:
            raise InputError(f"{path}: {key}: a text was expected, got {short(value)}")
    flown = {key: value for key, value in content.items() if key in Scenario.model_fields}
    context.meta[_PARAMETERS] = validate(Scenario, flown, str(path)).parameters
    content.pop("parameters", None)
    context.default_map = {**content, **(context.default_map or {})}


def _scenario_option(help: str, ignored: Collection[str] = ()) -> Decorator:
    return click.option(
        "--scenario",
        type=click.Path(path_type=Path),
        is_eager=True,
        callback=partial(_use_scenario, ignored=ignored),
        expose_value=False,
        help=help,
    )


def _parameters(
    context: click.Context, option: click.Parameter, texts: Any
) -> dict[str, dict[str, Any]]:
    """``plant.hold_ticks=40`` to ``{"plant": {"hold_ticks": 40}}``, over the scenario's."""
    parameters: dict[str, dict[str, Any]] = context.meta.pop(_PARAMETERS, {})
    if texts:
        from ..scenario.objects import set_parameter

        for text in texts:
            set_parameter(parameters, text, "--set")
    return parameters


_PARAMETERS = f"{__name__}.parameters"
"""Key of a scenario's parameters in the context's ``meta``."""

OTHERS: dict[str, Decorator] = {
    "bag": click.option(
        "--bag", type=click.Path(path_type=Path), help="Folder of the bag to write."
    ),
    "set": click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="NODE.PARAM=VALUE",
        callback=_parameters,
        help="Any parameter of a node, as plant.hold_ticks=40; may be repeated.",
    ),
    "scenario": _scenario_option(
        "YAML file with any of these options; those given here come first."
    ),
    "flight_scenario": _scenario_option(
        "YAML file of a flight's options, of which those of this command count.", OPTIONS
    ),
    "json": click.option("--json", "as_json", is_flag=True, help="Print the report as JSON."),
}
"""Options of flying commands that do not define the flight."""
_EXTRAS = ("bag", "set", "scenario", "json")
ON_A_GRAPH = (*OPTIONS, *_EXTRAS)
ON_A_FLIGHT = tuple(name for name in ON_A_GRAPH if name in _EXTRAS or not OPTIONS[name].needs_graph)


def flight_option(name: str) -> Decorator:
    """Return an option of a scenario, or of `OTHERS`, by its name."""
    if name in OTHERS:
        return OTHERS[name]
    return _robot_options if name == "robot" else _click_option(name)


def flight_options(*names: str) -> Decorator:
    """Give a command options by name, in that order."""

    def decorate(function: Any) -> Any:
        for name in reversed(names):
            function = flight_option(name)(function)
        return function

    return decorate


def plan_flight(**options: Any) -> Flight:
    """Return the flight plan defined by the options of a command.

    Raises:
        InputError: options conflict, or a name is unknown.
    """
    from ..flight.plan import Flight

    return Flight(resolve_options(**options))


def resolve_options(**options: Any) -> ResolvedScenario:
    """Return the scenario defined by the options of a command, as `plan_flight` flies it.

    Raises:
        InputError: options conflict, or a name is unknown.
    """
    from space_robot_msgs_py.config.validation import validate

    from ..scenario.resolve import resolve
    from ..scenario.scenario import Scenario

    context = click.get_current_context(silent=True)
    if context and context.get_parameter_source("controller") is ParameterSource.DEFAULT:
        options.pop("controller", None)  # the robot's own gains may name another
    return resolve(validate(Scenario, options, "options"))


def remarks_on(flight: Flight) -> list[str]:
    """Return the warnings to print before a flight begins.

    On a repaired robot file, a start away from the mission's, a base that floats freely under a
    mission that controls it, waypoints that ask too much of the actuators, gains with too little
    margin (of default gains only where hardware or a fault tries the margin), of joints that are
    asked too much.
    """
    from space_robot_model.robot.description import unit_remarks

    from ..flight.mission_demand import demand_remark
    from ..tuning.gain_check import pair_corner
    from ..tuning.warning import limit_remarks, margin_remarks

    names, robot = flight.plant.names, flight.plant.robot
    # the default gains of an ideal plant are the project's own choice: nobody is warned of them
    tries_margin = (
        flight.scenario.has_chosen_gains or bool(flight.scenario.faults) or bool(names.actuators)
    )
    warned = [*unit_remarks(flight.robot), *flight.remarks, demand_remark(flight.scenario)]
    return [
        *(f"repaired: {text}" for text in flight.robot.repairs),
        *(f"warning: {text}" for text in warned if text),
        *margin_remarks(
            [flight.law, *(law for _, law in flight.swaps)],
            robot,
            flight.mission_settings,
            pair_corner(flight.controller_settings),
            flight.controls_base,
            on_thrusters=bool(names.thrusters and not names.wheels),
            on_thin_margin=tries_margin,
            nominal=flight.robot,
        ),
        *limit_remarks(robot, flight.mission.pieces),
    ]
