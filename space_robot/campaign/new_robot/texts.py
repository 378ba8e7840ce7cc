"""The files that tell a robot in a folder of its own."""

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
#   passive: {{hinge: {{stiffness: 120.0, damping: 0.3}}}}   springs in the place of motors
#   tools: [left_hand, right_hand]                       links whose frames are end effectors
"""


def robot_texts(
    file: Path, base: str | None, repair: bool, command: str
) -> tuple[dict[str, str], Robot]:
    """Return the texts of the files that tell a robot, by their names, and the robot.

    A URDF stays a URDF, expanded if it was xacro, beside a YAML that refers to it. Of a YAML there
    is one that is complete in itself.

    Args:
        file: URDF, xacro or YAML.
        base: the link that is the satellite, of a URDF (None: its root).
        repair: whether a URDF's defects are repaired.
        command: what asks for it, for the YAML.

    Raises:
        InputError: the file is wrong, or what was asked is for a URDF.
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
