"""Templates of a user's own pieces: a commented file that flies at once, and its tests."""

from __future__ import annotations

import json
import keyword
import shlex
from collections.abc import Callable, Mapping
from importlib import resources
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import NamedTuple

import click

from space_robot_msgs_py.errors import InputError

from .options import flight_option, folder_option


class PieceTemplate(NamedTuple):
    """A kind of piece and its files."""

    name: str
    files: Mapping[str, str]
    """Name of each file, with ``$name`` in it, by its template."""
    command: str
    """Commands that use it, a line each, with the path of each file by its template's name."""
    is_shipped: Callable[[str], bool]
    """True for the name of a shipped one."""


def _is_law(name: str) -> bool:
    from space_robot_control.controller.law_choice import NoLaw
    from space_robot_control.laws import laws

    return name in laws() or name == NoLaw.name


def _is_in_config(kind: str) -> Callable[[str], bool]:
    def is_shipped(name: str) -> bool:
        from space_robot_msgs_py.config.files import is_named

        return is_named(kind, name)

    return is_shipped


LAW = PieceTemplate(
    "law",
    {"law.py": "$name.py", "law.yaml": "$name.yaml", "test_law.py": "test_$name.py"},
    "space-robot simulate --controller $law_py:$Name --gains $law_yaml",
    _is_law,
)
SENSOR = PieceTemplate(
    "sensor",
    {"sensor.yaml": "$name.yaml", "test_sensor.py": "test_$name.py"},
    "space-robot simulate --sensors $sensor_yaml",
    _is_in_config("sensors"),
)
METRIC = PieceTemplate(
    "metric",
    {"metric.py": "$name.py", "test_metric.py": "test_$name.py"},
    "space-robot simulate --bag flights/$name\n"
    "space-robot analyze flights/$name --metric $metric_py:$name",
    lambda name: False,  # names of metrics have a point
)
MISSION = PieceTemplate(
    "mission",
    {"mission.yaml": "$name.yaml", "test_mission.py": "test_$name.py"},
    "space-robot simulate$robot_option --mission $mission_yaml",
    _is_in_config("missions"),
)


def check_name(name: str, piece: PieceTemplate) -> None:
    """Check that a new piece may have a name.

    Raises:
        InputError: it is no word in lower case, or pytest would take its file for tests.
    """
    is_word = name.isidentifier() and name.isascii() and name == name.lower()
    if not is_word or keyword.iskeyword(name) or name.startswith(("_", "test")):
        raise InputError(
            f"{name!r} is no name of a {piece.name}: lower-case letters, digits and _ are "
            "allowed, a letter first; not a word of Python, and not test..."
        )


def check_not_taken(name: str, piece: PieceTemplate) -> None:
    """Check that no other piece has a name, and no Python module, which a file of it would hide.

    Raises:
        InputError: one has it.
    """
    if piece.is_shipped(name):
        raise InputError(f"{name} is the name of a shipped {piece.name}: choose another")
    if piece.name in ("law", "metric") and find_spec(name) is not None:
        raise InputError(
            f"{name} is the name of a Python module, which {name}.py would hide: choose another"
        )


def write_files(piece: PieceTemplate, name: str, folder: Path, words: Mapping[str, str]) -> str:
    """Write the files of a new piece, with further words of its templates; return its command."""
    from ..console.files import check_free, write_text  # slow to import

    check_name(name, piece)
    paths = {
        key: folder / Template(file).substitute(name=name) for key, file in piece.files.items()
    }
    for path in paths.values():
        check_free(path)
    check_not_taken(name, piece)
    by_word = {key.replace(".", "_"): path for key, path in paths.items()}
    common = {"name": name, "Name": "".join(part.capitalize() for part in name.split("_")), **words}
    command = Template(piece.command).substitute(
        common, **{word: shlex.quote(str(path)) for word, path in by_word.items()}
    )
    in_texts = {
        **common,
        "command": command.replace("\n", "\n    "),
        "path": str(next(iter(paths.values()))),
        **{word: path.name for word, path in by_word.items()},
    }
    templates = resources.files(__package__) / "templates"
    for key, path in paths.items():
        text = (templates / f"{key}.txt").read_text("utf-8")
        write_text(Template(text).substitute(in_texts), path)
    made = ", ".join(str(path) for path in paths.values())
    tests = shlex.quote(str(paths[f"test_{piece.name}.py"]))
    click.echo(f"made {made}: `pytest {tests}` tests it; to use it:", err=True)
    return command


OUT = folder_option("--out", help="Folder for the files [default: the current one].")


def _make_command(piece: PieceTemplate, text: str, example: str) -> click.Command:
    def make(name: str, out: Path | None) -> None:
        click.echo(write_files(piece, name, out or Path(), {}))

    make.__doc__ = f"""{text}

    Existing files are not overwritten. The last line printed is the command to fly it.

    \b
    Example:
      space-robot new {piece.name} {example}
    """
    return click.command(piece.name)(click.argument("name")(OUT(make)))


law = _make_command(
    LAW,
    "Write a control law with gains and tests.\n\n    NAME.py has its equation, NAME.yaml its "
    "gains, test_NAME.py its tests.",
    "my_law",
)
sensor = _make_command(
    SENSOR,
    "Write sensors with numbers and tests.\n\n    NAME.yaml has the numbers of data sheets, "
    "test_NAME.py their tests.",
    "my_sensors",
)
metric = _make_command(
    METRIC,
    "Write a metric with its tests.\n\n    NAME.py has a function of a flight's log, "
    "test_NAME.py its tests.",
    "overshoot",
)


@click.command()
@click.argument("name")
@OUT
@flight_option("robot")
def mission(name: str, out: Path | None, robot: str) -> None:
    """Write a mission with its tests.

    NAME.yaml has segments to be changed, test_NAME.py its tests. It begins where the robot's own
    mission does. Existing files are not overwritten. The last line
    printed is the command to fly it.

    \b
    Examples:
      space-robot new mission inspect
      space-robot new mission inspect --robot seven_joint
    """
    click.echo(write_files(MISSION, name, out or Path(), _mission_words(robot)))


STEP_DEG, STEP_M = 10.0, 0.05
"""Steps of the joints in the template of a mission."""


def _mission_words(name: str) -> dict[str, str]:
    from ..flight.plan import Scenario, resolve

    scenario = resolve(Scenario(robot=name))
    robot, start = scenario.robots.plant, scenario.plant.initial_joints_deg
    goal = []
    for joint, position in enumerate(start):
        step = STEP_M if robot.is_prismatic[joint] else STEP_DEG
        stepped = list(start)
        stepped[joint] += step
        is_within = robot.from_degrees(stepped)[joint] < robot.limits[joint].upper
        goal.append(round(position + (step if is_within else -step), 6))
    return {
        "robot": name,
        "robot_literal": json.dumps(str(name)),
        "robot_option": "" if name == Scenario().robot else f" --robot {shlex.quote(name)}",
        "start": str(list(start)),
        "goal": str(goal),
    }
