"""A robot by its name or its files, and where its mission and its gains are.

A robot is named by a name of ``config/robots``, by a path to a ``.yaml``, ``.urdf`` or ``.xacro``
(with what is chosen of it: see `space_robot_model.robot.choice`), or by a folder of its own:

    robot.yaml (or robot.urdf, robot.xacro)
    mission.yaml
    gains/<set>/<law>.yaml, gains/default_sets.yaml

The mission and the gains of a robot that has no such folder are those of ``config/`` that are
called as its file is. A name without a slash is never a folder's (see `robot_as_path`), so that
names out of bags open nothing but what is shipped.
"""

from __future__ import annotations

import os.path
import shlex
from dataclasses import dataclass
from pathlib import Path

from space_robot_msgs_py.config.arguments import path_text
from space_robot_msgs_py.config.choices import choices
from space_robot_msgs_py.config.directory import config_directory
from space_robot_msgs_py.config.files import GIVEN, is_named, named_file
from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.config.yaml_text import check_file, is_folder
from space_robot_msgs_py.errors import InputError

from .choice import split_choice
from .robot import Robot
from .source import URDF, YAML, RobotSource, read_robot_file

ROBOTS = "robots"
"""The folder of the shipped robots in the config folder."""
OWN = "robot"
"""Name, less its ending, of the robot's file in a folder of its own."""
OWN_MISSION, OWN_GAINS = "mission.yaml", "gains"


@dataclass(frozen=True)
class RobotFiles:
    """Where a robot and what belongs to it are."""

    name: str
    """That its mission and gains go by: a name of ``config/``, of a file, or of a folder."""
    file: Path
    mission: Path | None
    """None: it has none of its own."""
    gains: Path | None
    """The folder of its gain sets; None: it has none."""


def robot_names() -> list[str]:
    """Return the names of the shipped robots."""
    return sorted(file.stem for file in (config_directory() / ROBOTS).glob("*.yaml"))


def robot_files(robot: str) -> RobotFiles:
    """Find the files of a robot, by name or path.

    Raises:
        InputError: there is no such robot; names those there are.
    """
    if robot == GIVEN:
        return RobotFiles(GIVEN, Path(GIVEN), None, None)
    robot = split_choice(robot).name
    path = Path(robot)
    if robot.endswith((*YAML, *URDF)):
        check_file(path)
        return _own_folder(path) if path.stem == OWN else _in_config(path)
    if "/" in robot:
        return _own_folder(_file_of(path))
    if not is_named(ROBOTS, robot):
        raise InputError(
            f"unknown robot {short(robot)}: "
            f"{choices(robot, robot_names(), ', or a path to a .yaml or .urdf file or a folder')}"
        )
    return _in_config(config_directory() / ROBOTS / f"{robot}.yaml")


def find_robot(robot: str, base: str | None = None, repair: bool = False) -> Robot:
    """Read a robot by name or path.

    Args:
        robot: see above.
        base: the link that is the satellite, of a URDF (None: what the name says, else its root).
        repair: whether a URDF's defects are repaired, or the name says so.

    Raises:
        InputError: there is no such robot, or its file is wrong.
    """
    return robot_source(path_text(robot, "robot"), base, repair).robot


def robot_source(robot: str, base: str | None = None, repair: bool = False) -> RobotSource:
    """Read a robot's file by name or path, as `find_robot` does."""
    chosen = split_choice(robot)
    return read_robot_file(robot_files(robot).file, base or chosen.base, repair or chosen.repair)


def mission_file(robot: str, mission: str = "") -> Path:
    """Return the file of a mission, of the robot's own if the name is empty.

    Raises:
        InputError: there is none, or no such robot; says what to do.
    """
    if mission:
        return named_file("missions", mission)
    files = robot_files(robot)
    if robot == GIVEN:
        raise InputError("a robot that no file tells has no mission of its own: give one")
    if files.mission is None:
        find_robot(robot)  # what is wrong with that comes first
        raise InputError(
            f"robot {short(robot)} has no mission of its own: `{new_command(robot)}` "
            "makes it one, with gains; or name a mission"
        )
    return files.mission


def mission_layers(robot: str, mission: str) -> list[Path]:
    """Return the `mission_file`; none of a mission that is `GIVEN`.

    Raises:
        InputError: see `mission_file`.
    """
    return [] if mission == GIVEN else [mission_file(robot, mission)]


def new_command(robot: str) -> str:
    """Return the command that makes a mission and gains for a robot."""
    chosen = split_choice(robot)
    words = ["space-robot", "new", str(robot_files(robot).file)]
    words += ["--base", chosen.base] if chosen.base else []
    return shlex.join([*words, *(["--repair"] if chosen.repair else [])])


def robot_as_path(robot: str) -> str:
    """Return what a user means by a robot's name: ``r``, if no robot is called so, is a path.

    It is then the folder ``r/`` or the file ``./r``. Not for names out of bags: these open no
    folder of the user's.
    """
    name = split_choice(robot).name
    if not name or "/" in name or name.endswith((*YAML, *URDF)) or is_named(ROBOTS, robot):
        return robot
    if is_folder(Path(robot)):
        return f"{robot}/"
    return f"./{robot}" if os.path.isfile(name) else robot


def _in_config(file: Path) -> RobotFiles:
    config, name = config_directory(), file.stem
    mission, gains = config / "missions" / f"{name}.yaml", config / "gains" / name
    return RobotFiles(
        name, file, mission if mission.is_file() else None, gains if is_folder(gains) else None
    )


def _own_folder(file: Path) -> RobotFiles:
    folder = file.parent
    mission, gains = folder / OWN_MISSION, folder / OWN_GAINS
    return RobotFiles(
        folder.resolve().name,
        file,
        mission if mission.is_file() else None,
        gains if is_folder(gains) else None,
    )


def _file_of(folder: Path) -> Path:
    """Return the robot's file in a folder of its own."""
    endings = (*YAML, *URDF)
    if os.path.lexists(folder) and not is_folder(folder):
        raise InputError(
            f"robot {short(str(folder))}: not a robot's file, whose name ends in one of "
            f"{', '.join(endings)}"
        )
    if not is_folder(folder):
        raise InputError(f"robot {short(str(folder))}: no such file or folder")
    names = [OWN + ending for ending in endings]
    for name in names:
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"{folder}: no robot in this folder ({', '.join(names)})")
