"""The command ``space-robot plan``: show what a mission asks for, without flying it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .completed_names import names_in
from .numbers import FiniteRange
from .options import file_option, flight_options, resolve_options
from .scenario_option import NameOrNumbers

SECTION = "Robots, missions and own pieces"


@click.command()
@click.argument("mission", default="", type=NameOrNumbers(), shell_complete=names_in("missions"))
@flight_options("robot", "orbit", "actuators", "period", "scenario_of_flight", "set", "json")
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
    from ..console.terminal import echo_json, terminal
    from ..flight.mission_demand import held_base_remark
    from .plan_display import print_plan

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
        from ..analysis.figures.mission_plan import draw_plan

        draw_plan(robot, segments, figure)
    if as_json:
        echo_json(report)
    else:
        print_plan(report, terminal())
    if refused := report["refused"]:
        raise FlightError(f"refused: {refused}")
