"""Search of a robot by name or path, and of its mission and gains.

A robot is given by a name of ``config/robots``, by a path to a ``.yaml``, ``.urdf`` or ``.xacro``
(with options: ``my.urdf?base=LINK&repair``, so that one text defines a robot in commands, nodes and
bags), or by its own folder:

    robot.yaml (or robot.urdf, robot.xacro)
    mission.yaml
    gains/<set>/<law>.yaml, gains/default_sets.yaml

Mission and gains of a robot without such a folder are those of ``config/`` with the name of its
file. A name without a slash is never that of a folder (see `robot_as_path`), so that names from
bags open shipped files only.
"""

from __future__ import annotations

import os.path
import re
import shlex
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from pathlib import Path
from typing import Any, NamedTuple
from urllib.parse import quote, unquote

import yaml

from space_robot_msgs_py.config.arguments import path_text
from space_robot_msgs_py.config.files import GIVEN, is_named, named_file
from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.config.text import choices, printable
from space_robot_msgs_py.config.validation import read_yaml, short
from space_robot_msgs_py.config.yaml_text import check_readable, is_folder, parse_yaml, read_file
from space_robot_msgs_py.errors import InputError, explained_by

from .files import is_urdf, readable_document
from .robot import Robot

YAML, URDF = (".yaml", ".yml"), (".urdf", ".xacro")
ROBOTS = "robots"
"""Folder of the shipped robots in the config folder."""
ROBOT_STEM = "robot"
"""Name, without suffix, of the robot's file in its own folder."""
OWN_MISSION, OWN_GAINS = "mission.yaml", "gains"
TRAJECTORIES = (".csv", ".parquet")
"""Suffixes of missions that are tables of a trajectory."""
_CHOICE = re.compile(r"\?(?=base=|repair$)(?:base=([^&?./]+))?(?:&?(repair))?$")


class RobotChoice(NamedTuple):
    """A robot's name, split into its parts."""

    name: str
    """Name without options."""
    base: str | None
    """Name of the link that is the satellite; None: the root."""
    repair: bool
    """True to repair defects."""


def with_choice(robot: str, base: str | None, repair: bool) -> str:
    """Return the name of a robot with options; `split_choice` is the inverse."""
    chosen = [f"base={quote(base, safe='').replace('.', '%2E')}"] if base else []
    chosen += ["repair"] if repair else []
    return f"{robot}?{'&'.join(chosen)}" if chosen else robot


def split_choice(robot: str) -> RobotChoice:
    """Split a robot's name; any text is accepted."""
    match = _CHOICE.search(robot)
    if not match:
        return RobotChoice(robot, None, False)
    return RobotChoice(robot[: match.start()], match[1] and unquote(match[1]), bool(match[2]))


@dataclass(frozen=True)
class RobotFiles:
    """Paths of a robot's file, mission and gains."""

    name: str
    """Name for mission and gains: of ``config/``, of the file, or of the folder."""
    file: Path
    mission: Path | None
    """Its own mission; None: it has none."""
    gains: Path | None
    """Folder of its gain sets; None: it has none."""


def robot_names() -> list[str]:
    """Return the names of the shipped robots."""
    return sorted(file.stem for file in (config_directory() / ROBOTS).glob("*.yaml"))


@explained_by("own-robot")
def robot_files(robot: str) -> RobotFiles:
    """Find the files of a robot, by name or path.

    Raises:
        InputError: there is no such robot; lists the shipped ones.
    """
    if robot == GIVEN:
        return RobotFiles(GIVEN, Path(GIVEN), None, None)
    robot = split_choice(robot).name
    path = Path(robot)
    if robot.endswith((*YAML, *URDF)):
        check_readable(path)
        return _in_own_folder(path) if path.stem == ROBOT_STEM else _in_config(path)
    if "/" in robot:
        return _in_own_folder(_folder_file(path))
    if not is_named(ROBOTS, robot):
        raise InputError(
            f"unknown robot {short(robot)}: "
            f"{choices(robot, robot_names(), ', or a path to a .yaml or .urdf file or a folder')}"
            f"{_file_here(path)}"
        )
    return _in_config(config_directory() / ROBOTS / f"{robot}.yaml")


def _file_here(path: Path) -> str:
    stem = path.parent / path.stem
    files = (Path(f"{stem}{suffix}") for suffix in (*URDF, *YAML))
    same = next((str(file) for file in files if os.path.isfile(file)), "")
    return f" (did you mean {printable(same)}?)" if same else ""


def find_robot(robot: str, base: str | None = None, repair: bool = False) -> Robot:
    """Read a robot by name or path.

    Args:
        robot: name or path, see above.
        base: the link that is the satellite, of a URDF (None: as in the name, else its root).
        repair: True to repair a URDF's defects, also if the name does not request it.
    """
    return robot_source(path_text(robot, "robot"), base, repair).robot


def robot_source(robot: str, base: str | None = None, repair: bool = False) -> RobotSource:
    """Read a robot's file by name or path, as `find_robot` does."""
    chosen = split_choice(robot)
    return read_robot_file(robot_files(robot).file, base or chosen.base, repair or chosen.repair)


@explained_by("own-trajectory")
def mission_layers(robot: str, mission: str) -> list[Path]:
    """Return the file of a mission in a list; an empty list for `GIVEN`.

    Args:
        robot: name or path.
        mission: name or path; empty: the robot's own mission.

    Raises:
        InputError: there is no such mission or robot; with advice.
    """
    if mission == GIVEN:
        return []
    if mission.endswith(TRAJECTORIES):
        check_readable(Path(mission))
        return [Path(mission)]
    if mission:
        return [named_file("missions", mission)]
    files = robot_files(robot)
    if robot == GIVEN:
        raise InputError("a robot without file has no mission of its own: choose one")
    if files.mission is None:
        find_robot(robot)  # an invalid robot is reported first
        raise InputError(
            f"robot {short(robot)} has no mission of its own: `{new_command(robot)}` "
            "makes one, with gains; or choose a mission"
        )
    return [files.mission]


def new_command(robot: str) -> str:
    """Return the command that makes a mission and gains for a robot."""
    chosen = split_choice(robot)
    words = ["space-robot", "new", str(robot_files(robot).file)]
    words += ["--base", chosen.base] if chosen.base else []
    return shlex.join([*words, *(["--repair"] if chosen.repair else [])])


def remake_advice(file: Path) -> str:
    """Return what to do if a file in a robot's own folder is not for its joints; else nothing.

    Args:
        file: a mission or gains.
    """
    for folder in file.parents[:3]:
        names = (f"{ROBOT_STEM}{ending}" for ending in (*YAML, *URDF))
        if folder.name and any((folder / name).is_file() for name in names):
            words = ["space-robot", "new", f"{folder}/", "--out", str(folder), "--force"]
            return (
                f"; if the joints in {folder}/ have changed, `{shlex.join(words)}` makes mission "
                "and gains anew"
            )
    return ""


def robot_as_path(robot: str) -> str:
    """Interpret a user's robot name: ``r`` is a path if no shipped robot has this name.

    It is then the folder ``r/`` or the file ``./r``. Not for names from bags, which must not open
    the user's folders.
    """
    name = split_choice(robot).name
    if not name or "/" in name or name.endswith((*YAML, *URDF)) or is_named(ROBOTS, robot):
        return robot
    if is_folder(Path(robot)):
        return f"{robot}/"
    return f"./{robot}" if os.path.isfile(name) else robot


def _in_config(file: Path) -> RobotFiles:
    config, name = config_directory(), file.stem
    return _robot_files(name, file, config / "missions" / f"{name}.yaml", config / "gains" / name)


def _in_own_folder(file: Path) -> RobotFiles:
    folder = file.parent
    return _robot_files(folder.resolve().name, file, folder / OWN_MISSION, folder / OWN_GAINS)


def _robot_files(name: str, file: Path, mission: Path, gains: Path) -> RobotFiles:
    has_mission, has_gains = mission.is_file(), is_folder(gains)
    return RobotFiles(name, file, mission if has_mission else None, gains if has_gains else None)


def _folder_file(folder: Path) -> Path:
    endings = (*YAML, *URDF)
    if os.path.lexists(folder) and not is_folder(folder):
        raise InputError(
            f"robot {short(str(folder))}: not a robot's file, its suffix must be one of "
            f"{', '.join(endings)}"
        )
    if not is_folder(folder):
        raise InputError(f"robot {short(str(folder))}: no such file or folder")
    names = [ROBOT_STEM + ending for ending in endings]
    for name in names:
        if (folder / name).is_file():
            return folder / name
    raise InputError(f"{folder}: no robot in this folder ({', '.join(names)})")


@dataclass(frozen=True)
class RobotSource:
    """Content of a robot's file."""

    where: str
    """Name of the file, for errors."""
    content: dict[str, Any]
    """Self-contained mapping for `Robot.from_dict`."""
    text: str
    """The same as the text of a YAML file; for a YAML file its own text."""
    findings: tuple[str, ...] = ()
    """Defects of a URDF that were repaired."""

    @cached_property
    def robot(self) -> Robot:
        """The robot, built from `content`, hence equal to that of a bag with this content."""
        return replace(Robot.from_dict(self.content, where=self.where), repairs=self.findings)


def read_robot_file(file: Path, base: str | None = None, repair: bool = False) -> RobotSource:
    """Read a robot's file.

    Args:
        file: YAML or URDF.
        base: the link that is the satellite, of a URDF (None: its root).
        repair: whether a URDF's defects are repaired.

    Raises:
        InputError: the file is invalid, or ``base`` or ``repair`` is set for a YAML.
    """
    if file.suffix in URDF:
        head = f"From {file.name}{f', base {base}' if base else ''}."
        return _robot_source(Robot.from_urdf(file, base, repair), file, head)
    if base or repair:
        raise InputError(f"{file}: not a URDF, so base and repair cannot be chosen")
    content = read_yaml(file)
    if not is_urdf(content):
        return _yaml_source(str(file), read_file(file))
    head = f"From {file.name} and the URDF that it refers to."
    return _robot_source(Robot.from_yaml(file), file, head)


@lru_cache(maxsize=16)
def _yaml_source(where: str, text: str) -> RobotSource:
    # cached, since a campaign flies the same robot thousands of times
    return RobotSource(where, parse_yaml(text), text)


def _robot_source(robot: Robot, file: Path, head: str) -> RobotSource:
    content = readable_document(robot.tree)
    comments = [head, *(f"Repaired: {text}" for text in robot.repairs)]
    text = "".join(f"# {line}\n" for line in comments) + yaml.safe_dump(
        content, sort_keys=False, default_flow_style=None, width=10_000, allow_unicode=True
    )
    return RobotSource(str(file), content, text, robot.repairs)
