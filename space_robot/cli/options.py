"""Options that define a flight, shared by all commands."""

from __future__ import annotations

import functools
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
from click.core import ParameterSource

from ..scenario.option_table import Option, names, option
from .completed_names import names_in
from .scenario_option import NameOrNumbers, parameters, scenario, scenario_of_flight

if TYPE_CHECKING:
    from ..flight.plan import Flight
    from ..scenario.resolved import ResolvedScenario

Decorator = Callable[[Any], Any]


def _remap(context: click.Context, option: click.Parameter, texts: Any) -> dict[str, str]:
    """``/arm/states:=/joint_states`` to ``{"/arm/states": "/joint_states"}``."""
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

    @functools.wraps(function)
    def with_choice_of_urdf(*args: Any, base: str | None, repair: bool, **options: Any) -> Any:
        if base or repair:
            from space_robot_model.robot.find import with_choice

            options["robot"] = with_choice(options["robot"], base, repair)
        return function(*args, **options)

    for decorator in (REPAIR, BASE, _click_option(option("robot"))):
        decorator(with_choice_of_urdf)
    return with_choice_of_urdf


BASE = click.option("--base", metavar="LINK", help="The satellite, of a URDF [default: its root].")
REPAIR = click.option(
    "--repair", is_flag=True, help="Repair and list the repairable defects of a URDF."
)


def _click_option(entry: Option) -> Decorator:
    """Return a click option made from an option of the table."""
    dashed = f"--{entry.name.replace('_', '-')}"
    flag = entry.flag or dashed
    settings: dict[str, Any] = {"help": entry.help_text, "default": entry.default}
    if entry.kind == "switch":
        if entry.default:
            flag = f"{dashed}/--no-{dashed[2:]}"
        else:
            settings["is_flag"] = True
    elif entry.kind == "texts":
        settings |= {"multiple": True, "metavar": entry.metavar, "default": None}
        if entry.choices:
            settings["type"] = click.Choice(entry.choices)
    elif entry.choices:
        settings["type"] = click.Choice(entry.choices)
    elif entry.kind == "whole number":
        is_bounded = entry.low is not None and entry.high is not None
        settings["type"] = (
            click.IntRange(int(entry.low or 0), int(entry.high or 0)) if is_bounded else int
        )
    elif entry.kind == "number":
        settings["type"] = float
    elif entry.kind == "name":
        settings["type"] = NameOrNumbers()
    if entry.metavar:
        settings["metavar"] = entry.metavar
    if entry.folder:
        settings["shell_complete"] = names_in(entry.folder, entry.other_names)
    if entry.default not in (None, "") and entry.kind != "texts":
        settings["show_default"] = entry.kind != "switch" or bool(entry.default)
    if entry.name == "faults":
        settings["callback"] = _list_faults
    return click.option(flag, entry.name, **settings)


OTHERS: dict[str, Decorator] = {
    "bag": click.option(
        "--bag", type=click.Path(path_type=Path), help="Folder of the bag to write."
    ),
    "set": click.option(
        "--set",
        "parameters",
        multiple=True,
        metavar="NODE.PARAM=VALUE",
        callback=parameters,
        help="Any parameter of a node, as plant.hold_ticks=40; may be repeated.",
    ),
    "scenario": click.option(
        "--scenario",
        type=click.Path(path_type=Path),
        is_eager=True,
        callback=scenario,
        expose_value=False,
        help="YAML file with any of these options; those given here come first.",
    ),
    "scenario_of_flight": click.option(
        "--scenario",
        type=click.Path(path_type=Path),
        is_eager=True,
        callback=scenario_of_flight,
        expose_value=False,
        help="YAML file of a flight's options, of which those of this command count.",
    ),
    "json": click.option("--json", "as_json", is_flag=True, help="Print the report as JSON."),
}
"""Options of flying commands that do not define the flight."""
_OF_A_FLIGHT = ("bag", "set", "scenario", "json")
ON_A_FLIGHT = (*names(needs_graph=False), *_OF_A_FLIGHT)
ON_A_GRAPH = (*names(), *_OF_A_FLIGHT)


def flight_option(name: str) -> Decorator:
    """Return an option of the table, or of `OTHERS`, by its name."""
    if name in OTHERS:
        return OTHERS[name]
    return _robot_options if name == "robot" else _click_option(option(name))


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

    from ..scenario.options import FlightPlan
    from ..scenario.resolve import resolve

    context = click.get_current_context(silent=True)
    if context and context.get_parameter_source("controller") is ParameterSource.DEFAULT:
        options.pop("controller", None)  # the robot's own gains may name another
    return resolve(validate(FlightPlan, options, "options"))


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

    flown = [flight.law, *(law for _, law in flight.swaps)]
    corner = pair_corner(flight.controller_settings)
    names = flight.plant.names
    # the default gains of an ideal plant are the project's own choice: nobody is warned of them
    tries_margin = (
        flight.scenario.has_chosen_gains or bool(flight.scenario.faults) or bool(names.actuators)
    )
    on_gains = margin_remarks(
        flown,
        flight.plant.robot,
        flight.mission_settings,
        corner,
        flight.controls_base,
        on_thrusters=bool(names.thrusters and not names.wheels),
        on_thin_margin=tries_margin,
        nominal=flight.robot,
    )
    on_limits = limit_remarks(flight.plant.robot, flight.mission_settings)
    on_start = [f"warning: {text}" for text in flight.remarks]
    on_demand = [f"warning: {text}" for text in [demand_remark(flight.scenario)] if text]
    repaired = [f"repaired: {text}" for text in flight.robot.repairs]
    units = [f"warning: {text}" for text in unit_remarks(flight.robot)]
    return [*repaired, *units, *on_start, *on_demand, *on_gains, *on_limits]
