"""The command ``space-robot examples``: list and copy the example programs."""

from __future__ import annotations

import shutil
from collections.abc import Iterator
from pathlib import Path

import click

SUFFIXES = (".c", ".md", ".py", ".urdf")
"""Suffixes of an example's own files; others are made by running it."""
FOLDERS = ("examples", "examples/flight_computer")


@click.group(invoke_without_command=True)
@click.pass_context
def examples(context: click.Context) -> None:
    """List the example programs; `examples copy` copies them to a folder of your own.

    \b
    Examples:
      space-robot examples
      space-robot examples copy trials && cd trials && python examples/first_flight.py
    """
    if context.invoked_subcommand:
        return
    programs = [file for file in example_files(_share()) if file.suffix == ".py"]
    width = max((len(file.stem) for file in programs), default=0)
    for file in programs:
        click.echo(f"{file.stem:{width}}  {_topic(file)}")
    click.echo("\n`space-robot examples copy FOLDER` copies them, as files to run and to change.")


@examples.command()
@click.argument("folder", type=click.Path(path_type=Path, file_okay=False))
def copy(folder: Path) -> None:
    """Copy the programs to FOLDER/examples and the shipped configuration to FOLDER/config.

    There the commands of the documentation that name files of these two folders work as they are
    written. Names such as `--robot paper` still mean the installed files: an edited copy is named
    by its path, as in `--robot config/robots/paper.yaml`. Nothing is overwritten.

    \b
    Examples:
      space-robot examples copy trials
      space-robot examples copy .
    """
    from ..console.files import atomic_file, check_free

    share = _share()
    check_free(folder / "examples")
    check_free(folder / "config")
    config = sorted(file for file in (share / "config").rglob("*.*") if file.is_file())
    files = [*example_files(share), *config]
    for file in files:
        target = folder / file.relative_to(share)
        target.parent.mkdir(parents=True, exist_ok=True)
        with atomic_file(target) as written:
            written.write(file.read_bytes())
        shutil.copymode(file, target)
    click.echo(f"copied {len(files)} files to {folder / 'examples'} and {folder / 'config'}")


def _share() -> Path:
    """Return the folder of ``config/`` and ``examples/``: the clone, or the installed one.

    Raises:
        InputError: the installation is incomplete.
    """
    from space_robot_msgs_py.config.installation import config_directory
    from space_robot_msgs_py.errors import InputError

    share = config_directory().parent
    if not (share / "examples").is_dir():
        raise InputError("the examples are not installed: reinstall space_robot")
    return share


def example_files(share: Path) -> Iterator[Path]:
    """Yield the files of the examples in ``share``."""
    for folder in FOLDERS:
        for file in sorted((share / folder).iterdir()):
            if file.suffix in SUFFIXES or file.name == "Makefile":
                yield file


def _topic(file: Path) -> str:
    """Return the first line of a program's docstring."""
    import ast

    text = ast.get_docstring(ast.parse(file.read_text("utf-8"))) or ""
    return text.partition("\n")[0]
