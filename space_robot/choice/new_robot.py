"""Creates the folder of a new robot, and chooses the law that it flies."""

from __future__ import annotations

import math
import shlex
from collections.abc import Collection, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

import numpy as np

from space_robot_control.guidance.limits import MissionLimits
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.guidance.segments import read_segments
from space_robot_control.laws import laws
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_model.robot.description import unit_remarks
from space_robot_model.robot.files import is_urdf, read_content
from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_model.robot.urdf import UrdfRobot
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.environment import EnvironmentSettings

from ..console.files import atomic_folder
from ..tuning.task import force_demand
from .gain_files import make_default
from .law_search import TUNED_SET, ChoiceOptions
from .recommend import Recommendation, recommend
from .report import campaign_text
from .robot_files import CAMPAIGN_FILE, ROBOT_FILE

TRIAL: Mapping[str, Any] = {"case": "1", "sensors": "fine", "navigation": "filtered"}
"""Friction and hardware with which the laws are compared."""
CONDITIONS = "friction, sensors fine and navigation filtered"
HELD_S = 5.0
"""The candidates fly the first leg, and this long after it, s."""
CHOICE = "choice"
"""Folder of a longer choice by `space-robot choose`."""
SHORT = ChoiceOptions(evaluations=48, trial_s=6.0, runs=8, is_short=True)
"""How the law is chosen: shorter than `space-robot choose` does."""
LEG_S = 10.0
"""The shortest duration of a leg, s."""
LONGEST_LEG_S = 600.0
TURN, SLIDE = math.radians(30.0), 0.25
"""Largest displacement of a joint from its start: rad, m."""
RANGE_SHARE, LIMIT_SHARE = 0.25, 0.5
"""Largest displacement as a share of the joint's range; largest velocity and effort as shares of
their limits."""
BASE_TORQUE = 0.2 / 300.0
"""Torque of the base's actuators by the mass of the robot, N m/kg: 0.2 N m of the wheels of a
satellite of 300 kg; the space station's gyroscopes have 258 N m for 420 t."""
PEAK_VELOCITY = 1.875
"""Peak velocity of a rest-to-rest quintic, relative to its mean velocity."""


def rest_to_rest(robot: Robot) -> MissionSettings:
    """Return a mission for the actuated joints of ``robot``, the base's attitude held.

    Its legs last as long as the joints' limits need, and as the base needs for the torque of
    usual actuators (`BASE_TORQUE`), at most `LONGEST_LEG_S`.

    Raises:
        InputError: the limits would need legs longer than `LONGEST_LEG_S`.
    """
    nominal = robot.nominal
    lower, upper, velocity, effort = (
        np.array(column) for column in zip(*robot.limits, strict=True)
    )
    most = np.where(robot.is_prismatic[: robot.n], SLIDE, TURN)
    way = np.minimum(most, RANGE_SHARE * (upper - lower))
    start = np.clip(0.0, lower + way, upper - way)
    signs = np.where(np.arange(robot.n) % 2, -1.0, 1.0)
    points = np.array([start, start + signs * way, start - 0.5 * signs * way])
    longest = np.abs(np.diff(points, axis=0)).max(axis=0)
    leg = max(LEG_S, float(np.max(PEAK_VELOCITY * longest / (LIMIT_SHARE * velocity))))
    asked = force_demand(nominal, _mission(robot, points, leg), [EnvironmentSettings()]).nominal
    leg = math.ceil(leg * max(1.0, math.sqrt(float(np.max(asked[3:] / (LIMIT_SHARE * effort))))))
    if leg > LONGEST_LEG_S:
        raise InputError(
            f"robot {robot.name!r}: with its limits of velocity and effort the legs of a mission "
            f"would last {leg} s: write a mission by hand"
        )
    usual = LIMIT_SHARE * BASE_TORQUE * float(np.sum(robot.mass))
    slower = LEG_S * math.sqrt(float(np.max(asked[:3])) / usual)
    return _mission(robot, points, max(leg, min(math.ceil(slower), LONGEST_LEG_S)))


def mission_text(robot: Robot, mission: MissionSettings, command: str) -> str:
    """Return the text of a mission's file, one posture per line.

    Args:
        robot: whose joints the mission moves.
        mission: to be written.
        command: the user's command, for the header.
    """
    joints = ", ".join(
        f"{name} (m)" if slides else name
        for name, slides in zip(robot.joint_names, robot.is_prismatic, strict=False)
    )
    start = ", ".join(f"{value:g}" for value in mission.joints_deg)
    segments = "".join(f"    - {text}\n" for text in mission.segments)
    return (
        f"# Made by `{command}`: from rest to rest within the limits of the joints. Collisions\n"
        f"# are not checked. Joints: {joints}.\n"
        "mission:\n"
        f"  start: {{joints_deg: [{start}]}}\n"
        f"  segments:\n{segments}"
        "  limits: {check_actuators: false}\n"
    )


def _mission(robot: Robot, points: Array, leg: float) -> MissionSettings:
    start, *goals = np.round(robot.to_degrees(points), 3).tolist()
    rows = (", ".join(f"{value:g}" for value in goal) for goal in goals)
    return MissionSettings(
        joints_deg=start,
        segments=[f"{{joints_deg: [{row}], duration: {leg:g}}}" for row in rows],
        limits=MissionLimits(check_actuators=False),
    )


@dataclass(frozen=True)
class NewRobot:
    """The new robot, its files, and the law chosen for it."""

    folder: Path
    robot: Robot
    mission: MissionSettings
    choice: Recommendation
    remarks: tuple[str, ...] = ()
    """Remarks on units, tools and joints that may be passive, in sentences."""

    @property
    def duration(self) -> float:
        """Of the mission, s."""
        return sum(segment.span or 0.0 for segment in read_segments(self.mission.segments))

    def report(self) -> dict[str, Any]:
        """Return the content as data for JSON."""
        return {
            "folder": str(self.folder),
            "robot": self.robot.name,
            "joints": list(self.robot.joint_names),
            "passive_joints": list(self.robot.passive_names),
            "repaired": list(self.robot.repairs),
            "default_law": self.choice.law,
            "remarks": list(self.remarks),
            "duration": self.duration,
            "laws": {
                each.law: {"failure": each.reason} if each.reason else {"rms": each.rms}
                for each in self.choice.flown
            },
            "out": dict(self.choice.out),
        }


def make_robot(
    files: Mapping[str, str],
    robot: Robot,
    folder: Path,
    command: str,
    options: ChoiceOptions = SHORT,
) -> NewRobot:
    """Create the folder of a robot, and choose the law that it flies.

    Args:
        files: texts of the robot's files by name, see `robot_texts`.
        robot: defined by these files.
        folder: to be created or replaced, see `check_replaceable`; nothing is left of it after an
            error.
        command: the user's command, for the files' headers.
        options: of the choice.

    Raises:
        InputError: no mission is possible, or the folder cannot be written.
    """
    with atomic_folder(folder) as place:
        for name, text in files.items():
            (place / name).write_text(text, "utf-8")
        mission = rest_to_rest(robot)
        (place / OWN_MISSION).write_text(mission_text(robot, mission, command), "utf-8")
        gains = place / OWN_GAINS
        (leg, *_) = read_segments(mission.segments)
        scenario = {"robot": str(place), **TRIAL, "duration": (leg.span or 0.0) + HELD_S}
        choice = recommend(scenario, gains, options, command)
        if choice.law in laws():
            choice.install(gains, gains)
        else:
            make_default(TUNED_SET, gains)
        if choice.law:
            own = replace(choice, scenario={"robot": f"{folder}/", **TRIAL})
            text = campaign_text(own, folder / OWN_GAINS, command)
            (place / CAMPAIGN_FILE).write_text(text, "utf-8")
    advice = (
        f"With {CONDITIONS}: {choice.sentence}",
        tool_remark(robot, folder),
        hinge_remark(robot, command, folder),
    )
    return NewRobot(folder, robot, mission, choice, (*unit_remarks(robot), *filter(None, advice)))


def check_replaceable(folder: Path, force: bool, files: Collection[str]) -> None:
    """Check that a folder can be created or replaced.

    Args:
        folder: to be created.
        force: True if an existing folder may be replaced.
        files: names of the robot's files; only these, mission, gains and campaign may be
            overwritten.

    Raises:
        InputError: something exists there that must not be overwritten.
    """
    if not folder.exists() and not folder.is_symlink():
        return
    if not force:
        raise InputError(f"{folder}: exists already: choose another with --out, or use --force")
    if not folder.is_dir():
        raise InputError(f"{folder}: exists and is not a folder; it is not replaced")
    known = {*files, OWN_MISSION, OWN_GAINS, CAMPAIGN_FILE, CHOICE}
    if others := sorted(entry.name for entry in folder.iterdir() if entry.name not in known):
        raise InputError(f"{folder}: also contains {others[0]!r}: it is not replaced")


def tool_remark(robot: Robot, folder: Path) -> str:
    """Say which frame is the tool's, where bodies are fixed to it; empty if none are.

    Args:
        robot: made of the files.
        folder: with the robot's files.
    """
    content = read_yaml(folder / ROBOT_FILE)
    if not is_urdf(content) or content["robot"].get("tools"):
        return ""
    urdf = read_content(content, folder, str(folder))
    assert isinstance(urdf, UrdfRobot)
    fixed = [
        link.name
        for link in urdf.tree.links
        if link.parent == robot.tool.name and link.mass and not link.moves
    ]
    if not fixed:
        return ""
    return (
        f"Missions move the frame of {robot.tool.name}, to which {', '.join(fixed)} "
        f"{'is' if len(fixed) == 1 else 'are'} fixed; `tools: [LINK]` in robot.yaml names another "
        "link."
    )


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


def hinge_remark(robot: Robot, command: str, folder: Path) -> str:
    """Return a proposal to make possible hinges passive; empty if there are none.

    Args:
        robot: whose joints are looked at.
        command: the user's command.
        folder: that it made.
    """
    if not (names := hinges(robot)):
        return ""
    texts = [f"{name}:{own['stiffness']:g},{own['damping']:g}" for name, own in names.items()]
    options = [word for text in texts for word in ("--passive", text)]
    words = shlex.join([*options, "--out", str(folder), "--force"])
    each = "each carries" if len(names) > 1 else "it carries"
    return (
        f"{', '.join(names)}: {each} one body on the base. If that is a panel on a hinge "
        f"without a motor, `{command} {words}` gives it a spring (of {FREQUENCY_HZ:g} Hz: adapt "
        "it)."
    )
