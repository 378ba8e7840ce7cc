"""The command ``space-robot scenario``: print the settings of a flight."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import ON_A_GRAPH, file_option, flight_options, plan_flight

SECTION = "Fly"


@click.command()
@flight_options(*(name for name in ON_A_GRAPH if name != "bag"))
@file_option("--output", help="File to write to [default: standard output].")
def scenario(as_json: bool, output: Path | None, **options: Any) -> None:
    """Print the resolved scenario: every setting of a flight, independent of files.

    The YAML (or, with --json, JSON) is itself a scenario file: `--scenario` repeats the flight
    bit by bit, without the files that it was made from.

    \b
    Examples:
      space-robot scenario --case 3 --sensors fine
      space-robot scenario --robot seven_joint --output mine.yaml
      space-robot simulate --scenario mine.yaml
    """
    import json

    import yaml

    from ..console.files import write_text

    numbers = plan_flight(**options).scenario.tree
    if as_json:
        text = json.dumps(numbers, indent=2)
    else:
        text = yaml.safe_dump(numbers, sort_keys=False, default_flow_style=None, width=100).rstrip()
    if output is None:
        click.echo(text)
    else:
        write_text(text + "\n", output)
