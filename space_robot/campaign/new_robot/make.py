"""Creates the folder of a new robot, and flies all laws with its mission and gains."""

from __future__ import annotations

import math
import shlex
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.controller.settings import DEFAULT_SETS, OF_THE_SET, OTHERS
from space_robot_control.guidance.limits import MissionLimits
from space_robot_control.guidance.mission import MissionSettings
from space_robot_control.guidance.segments import read_segments
from space_robot_model.robot import Robot
from space_robot_model.robot.description import unit_remarks
from space_robot_model.robot.files import is_urdf, read_content
from space_robot_model.robot.find import OWN_GAINS, OWN_MISSION
from space_robot_model.robot.urdf import UrdfRobot
from space_robot_msgs_py.config.validation import read_yaml
from space_robot_msgs_py.errors import FlightError, InputError
from space_robot_sim.environment.environment import EnvironmentSettings

from ...analysis import measure
from ...analysis.measure import column_unit
from ...analysis.words import of_statistic
from ...console.files import atomic_folder
from ...flight.plan import Flight, Scenario, resolve
from ...flight.simulate import simulate
from ...processes.executor import cores, run_all
from ...tuning.gain_file import estimate_remark
from ...tuning.task import AUTO, TuningOptions, force_demand
from ..gain_set import tuned_set, write_set
from .texts import CAMPAIGN_FILE, ROBOT_FILE, campaign_text

SET, CASE = "tuned", "1"
"""Name of the tuned gain set, and the environment of tuning and flights."""
TRIAL: Mapping[str, Any] = {"case": "3", "sensors": "fine", "navigation": "filtered"}
"""Friction and hardware with which the laws are compared."""
CONDITIONS = "friction, payload and disturbances of case 3, sensors fine and navigation filtered"
REASON = f"it has the least errors and ripple (geometric mean) with {CONDITIONS}"
DIVERGED, BEYOND = "diverged", "went beyond the joints' limits of effort"
WISHES = TuningOptions(margin=0.05, mass_uncertainty=0.2, h_bar=AUTO)
"""Defaults of ``gains tune``, but that the estimate has the nominal inertia where it must."""


Array = NDArray[np.float64]

LEG_S = 10.0
"""The shortest duration of a leg, s."""
LONGEST_LEG_S = 600.0
TURN, SLIDE = math.radians(30.0), 0.25
"""Largest displacement of a joint from its start: rad, m."""
OF_THE_RANGE, OF_THE_LIMITS = 0.25, 0.5
"""Largest displacement as a share of the joint's range; largest velocity and effort as shares of
their limits."""
PEAK_VELOCITY = 1.875
"""Peak velocity of a rest-to-rest quintic, relative to its mean velocity."""


def rest_to_rest(robot: Robot) -> MissionSettings:
    """Return a mission for the actuated joints of ``robot``, the base's attitude held.

    Raises:
        InputError: the limits would need legs longer than `LONGEST_LEG_S`.
    """
    nominal = robot.nominal
    lower, upper, velocity, effort = (
        np.array(column) for column in zip(*robot.limits, strict=True)
    )
    most = np.where(robot.is_prismatic[: robot.n], SLIDE, TURN)
    way = np.minimum(most, OF_THE_RANGE * (upper - lower))
    start = np.clip(0.0, lower + way, upper - way)
    signs = np.where(np.arange(robot.n) % 2, -1.0, 1.0)
    points = np.array([start, start + signs * way, start - 0.5 * signs * way])
    longest = np.abs(np.diff(points, axis=0)).max(axis=0)
    leg = max(LEG_S, float(np.max(PEAK_VELOCITY * longest / (OF_THE_LIMITS * velocity))))
    asked = force_demand(nominal, _mission(robot, points, leg), [EnvironmentSettings()]).nominal[3:]
    leg *= max(1.0, math.sqrt(float(np.max(asked / (OF_THE_LIMITS * effort)))))
    leg = math.ceil(leg)
    if leg > LONGEST_LEG_S:
        raise InputError(
            f"robot {robot.name!r}: with its limits of velocity and effort the legs of a mission "
            f"would last {leg} s: write a mission by hand"
        )
    return _mission(robot, points, leg)


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
class Outcome:
    """Result of a law's flight."""

    rms: dict[str, float]
    """RMS of attitude (also in degrees) and joint errors and torques, mean of the axes; empty if it
    failed."""
    failure: str
    """Why the flight ended early; empty if it did not."""
    score: float
    """Geometric mean of errors and ripples on `TRIAL`; infinite if it failed there."""
    trial_failure: str = ""
    """`DIVERGED` or `BEYOND` if it did that on `TRIAL`; empty if neither or it was not flown."""


@dataclass(frozen=True)
class NewRobot:
    """The new robot, its files, and the results of its flights."""

    folder: Path
    robot: Robot
    mission: MissionSettings
    flights: dict[str, Outcome]
    """Results by law."""
    default_law: str
    """The law with the best score, which the gain set names; empty: none flew."""
    remarks: tuple[str, ...] = ()
    """Remarks on failures and weak laws, on tools and joints that may be passive, in sentences."""

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
            "default_law": self.default_law,
            "remarks": list(self.remarks),
            "duration": self.duration,
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
    with atomic_folder(folder) as place:
        for name, text in files.items():
            (place / name).write_text(text, "utf-8")
        (place / CAMPAIGN_FILE).write_text(campaign_text(folder, command), "utf-8")
        step("mission")
        mission = rest_to_rest(robot)
        (place / OWN_MISSION).write_text(mission_text(robot, mission, command), "utf-8")
        tuned = tuned_set({"robot": str(place)}, [CASE], WISHES, step)
        write_set(tuned, command, place / OWN_GAINS / SET)
        default = f"# The set of each law.\n{OTHERS}: {SET}\n"
        (place / OWN_GAINS / DEFAULT_SETS).write_text(default, "utf-8")
        names = sorted(tuned.laws)
        step(f"flying {', '.join(names)}")
        flights = dict(zip(names, run_all(partial(_fly, place), names, cores()), strict=True))
        best = min(names, key=lambda law: flights[law].score)
        best = best if math.isfinite(flights[best].score) else ""
        if best:
            with (place / OWN_GAINS / SET / OF_THE_SET).open("a", encoding="utf-8") as file:
                file.write(f"    controller: {best}  # flown unless another is named\n")
    said = f"{best} is flown unless another law is named: {REASON}." if best else ""
    advice = (
        said,
        trial_remark(flights),
        estimate_remark(tuned),
        tool_remark(robot, folder),
        hinge_remark(robot, command, folder),
    )
    remarks = (*unit_remarks(robot), *filter(None, advice))
    return NewRobot(folder, robot, mission, flights, best, remarks)


def _fly(folder: Path, law: str) -> Outcome:
    plan = Scenario(controller=law, robot=str(folder), case=CASE)
    try:
        metrics = _metrics(plan)
    except FlightError as error:
        return Outcome({}, str(error), math.inf)
    rms = {name: metrics[f"{name}.rms"] for name in of_statistic(metrics, "rms_eq64")}
    return Outcome(rms, "", *_trial(plan.model_copy(update=TRIAL)))


def _trial(plan: Scenario) -> tuple[float, str]:
    """Fly a trial and return its score and how it failed.

    Equal ratios count alike in the score, so that units do not matter.
    """
    try:
        metrics = _metrics(plan)
    except FlightError:
        return math.inf, DIVERGED
    if any(of_statistic(metrics, "beyond_effort").values()):
        return math.inf, BEYOND
    columns = [name for name in of_statistic(metrics, "rms_eq64") if name != "attitude_angle"]
    kinds = {name: "ripple" if column_unit(name).startswith("N") else "rms" for name in columns}
    known = [f"{name}.{kind}" for name, kind in kinds.items() if f"{name}.{kind}" in metrics]
    values = np.maximum([metrics[name] for name in known], np.finfo(float).tiny)
    return math.exp(float(np.mean(np.log(values)))), ""


def _metrics(plan: Scenario) -> dict[str, float]:
    """Return the metrics of a flight.

    Raises:
        FlightError: it diverged.
    """
    return measure(simulate(Flight(resolve(plan))))


def trial_remark(flights: Mapping[str, Outcome]) -> str:
    """Say which laws failed on `TRIAL`, and how; empty if none did."""
    failed = {
        how: [law for law, flown in flights.items() if flown.trial_failure == how]
        for how in (DIVERGED, BEYOND)
    }
    said = [f"{', '.join(names)} {how}" for how, names in failed.items() if names]
    return f"With {CONDITIONS}: {'; '.join(said)}." if said else ""


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
        command: the user's command, without the folder.
        folder: that it made.
    """
    names = hinges(robot)
    if not names:
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
