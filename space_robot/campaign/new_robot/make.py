"""Creates the folder of a new robot, and flies all laws with its mission and gains."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import yaml

from space_robot_control.controller.settings import DEFAULT_SETS
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_msgs_py.errors import FlightError

from ...analysis import Analysis
from ...flight.plan import Flight, FlightPlan, resolve
from ...flight.simulate import fly_blocks
from ...processes.pool import cores, run_all
from ...tuning.method import TuningOptions
from ...tuning.warning import estimate_remark
from ..gain_set import tuned_set, write_set
from .folder import whole_folder
from .motion import mission_text, rest_to_rest

SET, CASE = "tuned", "1"
"""Name of the tuned gain set, and the environment of tuning and flights."""
WISHES = TuningOptions(margin=0.05, mass_uncertainty=0.2)
"""Defaults of ``gains tune``."""


@dataclass(frozen=True)
class Outcome:
    """Result of a law's flight."""

    rms: dict[str, float]
    """RMS of attitude and joint errors and torques, mean of the axes; empty if it failed."""
    failure: str
    """Why the flight ended early; empty if it did not."""


@dataclass(frozen=True)
class NewRobot:
    """The new robot, its files, and the results of its flights."""

    folder: Path
    robot: Robot
    mission: MissionSettings
    flights: dict[str, Outcome]
    """Results by law."""
    remarks: tuple[str, ...] = ()
    """Remarks on weak laws and on joints that may be passive, in sentences."""

    def report(self) -> dict[str, Any]:
        """Return the content as data for JSON."""
        return {
            "folder": str(self.folder),
            "robot": self.robot.name,
            "joints": list(self.robot.joint_names),
            "passive_joints": list(self.robot.passive_names),
            "repaired": list(self.robot.repairs),
            "remarks": list(self.remarks),
            "duration": self.mission.waypoint_times[-1],
            "laws": {
                law: {"failure": flown.failure} if flown.failure else {"rms": flown.rms}
                for law, flown in self.flights.items()
            },
        }


def make_robot(
    files: Mapping[str, str],
    robot: Robot,
    folder: Path,
    command: str,
    step: Callable[[str], None] = lambda text: None,
) -> NewRobot:
    """Create the folder of a robot, and fly every law once with its mission and gains.

    Args:
        files: texts of the robot's files by name, see `robot_texts`.
        robot: defined by these files.
        folder: to be created or replaced, see `check_replaceable`; nothing is left of it after an
            error other than a failed flight.
        command: the user's command, for the files' headers.
        step: called with a description of each step.

    Raises:
        InputError: no mission is possible, or the folder cannot be written.
    """
    with whole_folder(folder) as place:
        for name, text in files.items():
            (place / name).write_text(text, "utf-8")
        step("mission")
        mission = rest_to_rest(robot)
        (place / OWN_MISSION).write_text(mission_text(robot, mission, command), "utf-8")
        tuned = tuned_set({"robot": str(place)}, [CASE], WISHES, step)
        write_set(tuned, command, place / OWN_GAINS / SET)
        default = "".join(f"{law}: {SET}\n" for law in tuned.gains)
        (place / OWN_GAINS / DEFAULT_SETS).write_text(f"# The set of each law.\n{default}", "utf-8")
        names = sorted(laws())
        step(f"flying {', '.join(names)}")
        outcomes = run_all(partial(_fly, place), names, cores())
    remarks = tuple(filter(None, (estimate_remark(tuned), hinge_remark(robot))))
    return NewRobot(folder, robot, mission, dict(zip(names, outcomes, strict=True)), remarks)


def _fly(folder: Path, law: str) -> Outcome:
    flight = Flight(resolve(FlightPlan(controller=law, robot=str(folder), case=CASE)))
    analysis = Analysis()
    try:
        for block in fly_blocks(flight):
            analysis.add(block)
    except FlightError as error:
        return Outcome({}, str(error))
    return Outcome(dict(analysis.report()["rms"]["mean_axis"]), "")


FREQUENCY_HZ, DAMPING_RATIO = 0.5, 0.005
"""Natural frequency and damping of proposed springs, typical of a large solar panel."""


def hinges(robot: Robot) -> dict[str, dict[str, float]]:
    """Return stiffness, N m/rad, and damping, N m s/rad, of the joints that may be hinges.

    These are revolute joints on the base that carry a single body without tool, if the robot also
    has an arm with more joints.
    """
    if max(robot.branches) < 2:
        return {}
    hinges = {}
    for joint, name in enumerate(robot.joint_names):
        body = joint + 1
        is_alone = robot.parent[joint] == 0 and body not in robot.parent
        if is_alone and not robot.is_prismatic[joint] and robot.tool.body != body:
            x, y, _ = robot.com[body]
            inertia = float(robot.inertia[body][2, 2] + robot.mass[body] * (x * x + y * y))
            rate = 2.0 * math.pi * FREQUENCY_HZ
            values = inertia * rate**2, 2.0 * DAMPING_RATIO * inertia * rate
            stiffness, damping = (float(f"{value:.2g}") for value in values)
            hinges[name] = {"stiffness": stiffness, "damping": damping}
    return hinges


def hinge_remark(robot: Robot) -> str:
    """Return a proposal to make possible hinges passive; empty if there are none."""
    names = hinges(robot)
    if not names:
        return ""
    flow = yaml.safe_dump(
        {"passive": names}, default_flow_style=True, sort_keys=False, width=math.inf
    )
    return (
        f"{', '.join(names)}: each carries one body on the base. If that is a panel on a hinge "
        f"without a motor, add to `robot:` in robot.yaml `{flow.strip()[1:-1]}` (springs of "
        f"{FREQUENCY_HZ:g} Hz: adapt them), and run `space-robot new` with that file."
    )
