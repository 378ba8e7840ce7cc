"""Files of a new robot's folder that define the robot."""

from __future__ import annotations

from pathlib import Path

import yaml

from space_robot_model.robot import Robot
from space_robot_model.robot.find import OWN
from space_robot_model.robot.source import URDF, read_robot_file
from space_robot_model.robot.urdf import read_urdf

ROBOT_FILE = f"{OWN}.yaml"
HEAD = """\
# Made by `{command}`. What URDF cannot say goes here:
#   passive: {{hinge: {{stiffness: 120.0, damping: 0.3}}}}   springs instead of motors
#   tools: [left_hand, right_hand]                       links whose frames are end effectors
"""

CAMPAIGN_FILE = "campaign.yaml"
CAMPAIGN = """\
# Made by `{command}`. `space-robot campaign run {folder}/{file}` flies it.
# The robot's masses, inertias and start are off a little, with payload and disturbances of case 3:
# does the base point within 1e-3 (error of the quaternion's vector part) in 90 % of such flights?
# More: docs/manual/campaigns.md.
scenario: {{robot: {folder}/, case: "3"}}   # the path begins where the command runs
laws: [tde_stc, ctc]
vary:
  robot.links[*].mass: {{normal: 1.0, sigma: 0.05, relative: true}}
  robot.base.inertia: {{scale: 0.1, rotate_deg: 3.0}}
  mission.start_deg: {{uniform: [-0.1, 0.1], offset: true}}
require:
  pointing: {{metric: attitude_max, below: 1.0e-3, in: 0.9, confidence: 0.9}}
runs: 40
"""


def campaign_text(folder: Path, command: str) -> str:
    """Return the text of a first campaign with the robot.

    Args:
        folder: of the robot.
        command: the user's command, for the header.
    """
    return CAMPAIGN.format(command=command, folder=folder, file=CAMPAIGN_FILE)


def robot_texts(
    file: Path, base: str | None, repair: bool, command: str
) -> tuple[dict[str, str], Robot]:
    """Return the texts of a robot's files by name, and the robot.

    A URDF stays a URDF, expanded if it was xacro, with a YAML that refers to it. A YAML becomes
    one self-contained file.

    Args:
        file: URDF, xacro or YAML.
        base: name of the link that is the satellite, of a URDF (None: its root).
        repair: whether a URDF's defects are repaired.
        command: the user's command, for the header.

    Raises:
        InputError: the file is invalid, or ``base`` or ``repair`` is set for a YAML.
    """
    source = read_robot_file(file, base, repair)
    if file.suffix not in URDF:
        return {ROBOT_FILE: source.text}, source.robot
    name = f"{file.stem}.urdf"
    texts = {
        "urdf": name,
        **({"base": base} if base else {}),
        **({"repair": True} if repair else {}),
    }
    text = HEAD.format(urdf=name, command=command) + yaml.safe_dump(
        {"robot": texts}, sort_keys=False, allow_unicode=True
    )
    return {ROBOT_FILE: text, name: read_urdf(file, base, repair).text}, source.robot
