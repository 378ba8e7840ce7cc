"""Pages that are made of the code: the commands' help and the docstrings, by package and room."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import click
from mkdocs.config.defaults import MkDocsConfig
from mkdocs.structure.files import File, Files

from space_robot.cli.main import cli

PUBLIC = """\
# Names for users

What programs import; names of other modules may change from version to version. `load_bag` returns
a [`FlightLog`][space_robot_msgs_py.bag.flight_log.FlightLog]; a law of one's own is a
[`ControlLaw`][space_robot_control.laws.base.ControlLaw]; bad input raises
[`InputError`][space_robot_msgs_py.errors.InputError]; for Gymnasium there is
[`SpaceRobotEnv`][space_robot.api.gymnasium_env.SpaceRobotEnv].

::: space_robot
"""
OF_PROGRAMS = {"campaign", "flight", "paper", "ros"}
"""Rooms that the commands are made of: of their files the page says what each is for, no more."""
WIDTH = 100
"""Columns of the commands' help."""
PACKAGES = (
    "space_robot",
    "space_robot_control",
    "space_robot_sim",
    "space_robot_model",
    "space_robot_msgs_py",
)


def on_files(files: Files, config: MkDocsConfig) -> Files:
    """Add the pages, and tell the navigation of them."""
    root = Path(config.config_file_path).parent
    files.append(File.generated(config, "reference/commands.md", content=commands()))
    files.append(File.generated(config, "reference/api/index.md", content=PUBLIC))
    python: list[object] = [{"Names for users": "reference/api/index.md"}]
    for package in PACKAGES:
        pages = []
        for room in rooms(root / package):
            uri = f"reference/api/{package}/{room.stem}.md"
            files.append(File.generated(config, uri, content=docstrings(room, root)))
            pages.append({room.stem: uri})
        python.append({package: pages})
    config.extra["added"] = {
        "Reference": [{"Commands": "reference/commands.md"}, {"Python": python}]
    }
    return files


def commands() -> str:
    """Text of the page with the help of each command, as it is printed."""
    parts = [
        "# Commands",
        *_help(cli, click.Context(cli, info_name="space-robot", terminal_width=WIDTH), 1),
    ]
    return "\n\n".join(parts)


def _help(command: click.Command, context: click.Context, level: int) -> Iterator[str]:
    if level > 1:
        yield f"{'#' * level} {context.command_path.partition(' ')[2]}"
    yield f"```text\n{command.get_help(context)}\n```"
    if isinstance(command, click.Group):
        for name in command.list_commands(context):
            inner = command.get_command(context, name)
            if inner and not inner.hidden:
                yield from _help(inner, click.Context(inner, context, name), level + 1)


def rooms(package: Path) -> Iterator[Path]:
    """Yield the folders of a package that are rooms, and its modules."""
    for path in sorted(package.iterdir()):
        is_room = (path / "__init__.py").exists() or path.suffix == ".py"
        if is_room and path.stem not in ("__init__", "cli"):  # the commands have their own page
            yield path


def docstrings(room: Path, root: Path) -> str:
    """Text of the page of a room: what stands in its files, once. The manual is found before."""
    files = sorted(room.rglob("*.py")) if room.is_dir() else [room]
    parts = ["---\nsearch:\n  boost: 0.5\n---"]
    for file in files:
        name = ".".join(file.relative_to(root).with_suffix("").parts).removesuffix(".__init__")
        options = [f"heading_level: {1 if file is files[0] else 2}"]
        is_brief = file.stem == "__init__" or room.name in OF_PROGRAMS
        options += ["members: false"] if is_brief else []
        parts.append(
            "\n      ".join([f"::: {name}", *options]).replace("\n", "\n    options:\n", 1)
        )
    return "\n\n".join(parts)
