"""The command ``space-robot plan``: show what a mission asks for, without flying it."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import click

from ..console.tables import Column, JudgedCell, Table, named
from .option_types import FiniteRange, names_in
from .options import file_option, flight_options, resolve_options


@click.command()
@click.argument("mission", default="", type=click.UNPROCESSED, shell_complete=names_in("missions"))
@flight_options("robot", "orbit", "actuators", "period", "flight_scenario", "set", "json")
@click.option(
    "--base-torque",
    type=FiniteRange(min=0.0, min_open=True),
    metavar="NM",
    help="Bend legs of the joints, lead tools with the least momentum, and stretch segments until "
    "no component of the base's torque is above this, N m.",
)
@click.option(
    "--momentum",
    type=FiniteRange(min=0.0, min_open=True),
    metavar="NMS",
    help="The same until the base takes up no more angular momentum than this, N m s.",
)
@file_option("--out", help="Write the mission as it was planned to a file.")
@file_option("--figure", help="Draw joints, tool, torque, momentum: FIGURE.svg and FIGURE.png.")
def plan(
    mission: str | dict[str, Any],
    as_json: bool,
    base_torque: float | None,
    momentum: float | None,
    out: Path | None,
    figure: Path | None,
    **options: Any,
) -> None:
    """Plan a mission without flying it: duration, tool, torque and momentum of the base.

    MISSION is a name of config/missions or a path; without it, the robot's own. Demands are those
    of the nominal robot without friction, in an orbit less the torques from outside; momentum is
    what the actuators have given since the start, without unloading. σ is the smallest singular
    value of the tool's Jacobian, with the base's attitude held and with a free base, its rows of
    translation divided by the tool's distance from the base: near zero the posture is singular.
    With --actuators that cannot give what the mission asks for, the exit code is 1.

    \b
    Examples:
      space-robot plan
      space-robot plan line.yaml --figure line
      space-robot plan line.yaml --base-torque 0.5 --out slow.yaml
      space-robot plan --robot seven_joint --json
      space-robot plan line --orbit iss --actuators my_wheels.yaml
      space-robot plan --scenario flight.yaml
    """
    import numpy as np

    from space_robot_control.guidance.limits import turn_remarks
    from space_robot_control.guidance.mission import Mission, MissionSettings
    from space_robot_model.robot.description import unit_remarks
    from space_robot_msgs_py.errors import FlightError

    from ..analysis.mission_plan import (
        lightened_mission,
        mission_text,
        plan_report,
        planned_segments,
        stretched_mission,
    )
    from ..console.files import write_text
    from ..console.terminal import echo_json
    from ..flight.mission_demand import held_base_remark

    scenario = resolve_options(mission=mission, controller=None, **options)
    robot, orbit, period = scenario.robots.controller, scenario.plant, scenario.plant.period
    planned, rate = scenario.reference, np.radians(scenario.plant.initial_rate_deg_s)
    settings: MissionSettings = scenario.mission
    chosen = {scenario.plant.actuators: scenario.assumed_actuators}
    scenario.plant.check(scenario.robots.plant, scenario.plant.actuators)
    held = filter(None, [held_base_remark(scenario)])
    for remark in (*unit_remarks(robot), *turn_remarks(robot, planned.pieces), *held):
        click.echo(f"warning: {remark}", err=True)
    segments = planned_segments(robot, planned, orbit, rate)
    report = plan_report(robot, segments, chosen)
    if base_torque is not None or momentum is not None:
        before = report
        settings = lightened_mission(robot, planned, settings, base_torque is not None)
        planned = Mission(robot, settings, period)
        lightened = plan_report(robot, planned_segments(robot, planned, orbit, rate))
        settings = stretched_mission(settings, lightened, base_torque, momentum)
        segments = planned_segments(robot, Mission(robot, settings, period), orbit, rate)
        report = plan_report(robot, segments, chosen)
        report |= {"before": before, "lightened": lightened}
    if out is not None:
        write_text(mission_text(settings), out)
    if figure is not None:
        from ..analysis.figures.single_flight import draw_plan

        draw_plan(robot, segments, figure)
    if as_json:
        echo_json(report)
    else:
        _print_plan(report)
    if refused := report["refused"]:
        raise FlightError(f"refused: {refused}")


TORQUE, MOMENTUM = Column("torque", "N m", ".3g"), Column("momentum", "N m s", ".3g")
SIGMA = (
    "σ: smallest singular value of the tool's Jacobian, with the base's attitude held and with a "
    "free base; its rows of translation are divided by the tool's distance from the base"
)
NO_MOMENTUM = 1e-9
"""Momentum at the end of a segment up to which there is none, N m s: at rest without an orbit."""
MANY = 1e3
"""Share from which a percentage is printed as a power of ten."""


def _print_plan(report: Mapping[str, Any]) -> None:
    from ..console.terminal import print_table, say, terminal

    console = terminal()
    columns: list[tuple[Column, Callable[[Mapping[str, Any]], Any]]] = [
        (named("segment"), lambda s: f"{s['segment']} {s['motion']}"),
        (Column("end", "s", ".2f"), lambda s: s["begin_s"] + s["duration_s"]),
        (Column("tool", "m", ".3f"), lambda s: s["tool_travel_m"]),
        (TORQUE, lambda s: s["base_torque"]),
        (MOMENTUM, lambda s: s["momentum"]),
        (Column("at its end", "N m s", ".3g"), lambda s: s["momentum_end"]),
        (Column("σ held", "", ".2g"), lambda s: s["singular_value"]),
        (Column("σ free", "", ".2g"), lambda s: s["free_singular_value"]),
    ]
    if all(s["momentum_end"] <= NO_MOMENTUM for s in report["segments"]):
        del columns[5]
    rows = [[value(segment) for _, value in columns] for segment in report["segments"]]
    print_table(Table.of("", [column for column, _ in columns], rows), console)
    say(console, SIGMA)
    if len(report["sources"]) > 1:
        sources = {**report["sources"], "all, without unloading": report}
        rows = [
            [name.replace("_", " "), own["base_torque"], own["momentum"], own["momentum_end"]]
            for name, own in sources.items()
        ]
        at_end = Column("at the end", "N m s", ".3g")
        print_table(Table.of("", [named("given for"), TORQUE, MOMENTUM, at_end], rows), console)
    rows = [
        [
            own["actuators"],
            _percent(own["torque"]),
            _percent(own["momentum"]),
            JudgedCell.of(own["is_feasible"], "yes", "no"),
        ]
        for own in report["actuators"]
    ]
    shares = Column("torque", "%", ".0f"), Column("momentum", "%", ".0f")
    print_table(Table.of("", [named("actuators"), *shares, named("feasible")], rows), console)
    say(
        console,
        f"{report['duration_s']:.2f} s; largest base torque {report['base_torque']:.3g} N m, "
        f"largest momentum {report['momentum']:.3g} N m s",
    )
    margins = [
        f"{kind} {100.0 * margin['share']:.0f} % ({margin['joint']} at {margin['time_s']:.2f} s)"
        for kind, margin in report["joints"].items()
    ]
    if margins:
        say(console, f"joints nearest to their limits: {', '.join(margins)}")
    for key, words in (("before", "before"), ("lightened", "in the same time, with lighter paths")):
        if other := report.get(key):
            say(
                console,
                f"{words}: {other['duration_s']:.2f} s, {other['base_torque']:.3g} N m, "
                f"{other['momentum']:.3g} N m s",
            )


def _percent(share: float) -> float | str:
    return 100.0 * share if not share >= MANY else f"{100.0 * share:.1e}"
