"""Files of a new robot's folder that define the robot."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import yaml

from space_robot_model.robot import Robot
from space_robot_model.robot.files import is_urdf, read_content
from space_robot_model.robot.find import ROBOT_STEM, URDF
from space_robot_model.robot.urdf import Mount, UrdfRobot, mounted_urdf
from space_robot_model.robot.urdf_links import with_absolute_meshes
from space_robot_msgs_py.config.validation import one_of, read_yaml
from space_robot_msgs_py.config.yaml_text import read_file
from space_robot_msgs_py.errors import InputError

ROBOT_FILE = f"{ROBOT_STEM}.yaml"
HEAD = "# Made by `{command}`.\n"
URDF_REMARKS = """\
# What URDF cannot say goes here:
#   passive: {hinge: {stiffness: 120.0, damping: 0.3}}   springs instead of motors
#   tools: [left_hand, right_hand]                       links whose frames are end effectors
# Mission and gains are for these joints: `space-robot new` of this folder makes them anew.
"""

CAMPAIGN_FILE = "campaign.yaml"


def robot_texts(
    file: Path,
    base: str | None,
    repair: bool,
    command: str,
    passive: Mapping[str, Mapping[str, float]] | None = None,
    mount: Mount | None = None,
) -> tuple[dict[str, str], Robot]:
    """Return the texts of a robot's files by name, and the robot.

    A URDF stays a URDF, expanded if it was xacro, with a YAML that refers to it; also that of a
    YAML which refers to one. Another YAML stays one file.

    Args:
        file: URDF, xacro or YAML.
        base: name of the link that is the satellite, of a URDF (None: its root).
        repair: whether a URDF's defects are repaired.
        command: the user's command, for the header.
        passive: stiffness and damping of joints that get a spring instead of a motor, by name.
        mount: a satellite on which the robot of a URDF is mounted as an arm.

    Raises:
        InputError: the file is invalid, it has no such joint, or ``base`` or ``repair`` is set for
            a YAML.
    """
    content: dict[str, Any]
    if file.suffix in URDF:
        choice: dict[str, Any] = {"urdf": file.name}
        if mount:
            mounted = mounted_urdf(file, mount, repair)
            choice = {"name": mounted.name, "urdf_text": mounted.text}
        choice |= {"base": base} if base else {}
        content = {"robot": {**choice, **({"repair": True} if repair else {})}}
    elif mount:
        raise InputError(f"{file}: not a URDF, so it cannot be mounted on a satellite")
    elif base or repair:
        raise InputError(f"{file}: not a URDF, so base and repair cannot be chosen")
    else:
        content = read_yaml(file)
    robot, head = content.get("robot"), HEAD.format(command=command)
    if not is_urdf(content):
        text = read_file(file)
        if passive:
            _make_passive(robot, passive, str(file))
            text = head + _dumped(content)
        return {ROBOT_FILE: text}, Robot.from_dict(content, str(file))
    assert isinstance(robot, dict)
    if passive:
        robot["passive"] = {**(robot.get("passive") or {}), **passive}
    read = Robot.from_dict(content, str(file), file.parent)
    urdf = read_content(content, file.parent, str(file))
    assert isinstance(urdf, UrdfRobot)
    own_name = f"{mounted.name}.urdf" if mount else file.name
    source = file.parent / str(robot.pop("urdf", own_name))
    robot.pop("urdf_text", None)
    name = f"{source.stem}.urdf"
    return {
        ROBOT_FILE: head + URDF_REMARKS + _dumped({"robot": {"urdf": name, **robot}}),
        name: with_absolute_meshes(urdf.text, source.absolute().parent),
    }, read


def _make_passive(robot: Any, passive: Mapping[str, Mapping[str, float]], where: str) -> None:
    """Give the links of a YAML's robot springs."""
    links = robot.get("links") if isinstance(robot, dict) else None
    by_name = {str(link.get("name")): link for link in links or () if isinstance(link, dict)}
    for name, spring in passive.items():
        by_name[one_of(name, by_name, "passive joint", f" of {where}")]["passive"] = dict(spring)


def _dumped(content: Mapping[str, Any]) -> str:
    return yaml.safe_dump(content, sort_keys=False, allow_unicode=True)
