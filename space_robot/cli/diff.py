"""The command ``space-robot diff``: list the settings in which two flights differ."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import flight_option

LONGEST = 60
"""Maximum characters of a value on a terminal; --json shows all."""


@click.command()
@click.argument("first", type=click.Path(path_type=Path))
@click.argument("second", type=click.Path(path_type=Path))
@flight_option("json")
def diff(first: Path, second: Path, as_json: bool) -> None:
    """List the settings in which two flights differ.

    FIRST and SECOND are bags, or scenario files as `space-robot scenario` prints them; names of
    files in a scenario are looked up here. Exit code 0 if all numbers are the same, 1 if not.

    \b
    Examples:
      space-robot diff flights/monday flights/tuesday
      space-robot diff flights/monday mine.yaml --json
    """
    from rich.console import Console

    from ..console.tables import Column, Table, named
    from ..console.terminal import echo_json, print_table, say
    from ..scenario.recorded import differences

    changes = list(differences(_resolved(first), _resolved(second)))
    if as_json:
        echo_json([difference._asdict() for difference in changes])
    elif not changes:
        say(Console(), "the same numbers")
    else:
        columns = (named("key"), Column(first.name), Column(second.name))
        rows = [(d.key, _short(d.first), _short(d.second)) for d in changes]
        print_table(Table.of("", columns, rows), Console())
    if changes:
        click.get_current_context().exit(1)


def _resolved(path: Path) -> dict[str, Any]:
    from space_robot_msgs_py.config.validation import read_yaml, validate

    from ..flight.plan import Flight, Scenario, resolve
    from ..scenario.recorded import options_in_bag

    if path.suffix not in (".yaml", ".yml"):
        return options_in_bag(path)
    return Flight(resolve(validate(Scenario, read_yaml(path), str(path)))).scenario.tree


def _short(value: Any) -> str:
    text = "-" if value is None else str(value)
    return text if len(text) <= LONGEST else f"{text[: LONGEST - 3]}..."
