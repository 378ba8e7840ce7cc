"""``space-robot scenario``: the numbers of a flight, without flying it."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from .options import ON_A_GRAPH, file_option, flight_options, plan_flight


@click.command()
@flight_options(*(name for name in ON_A_GRAPH if name != "bag"))
@file_option("--output", help="File to write to [default: standard output].")
def scenario(as_json: bool, output: Path | None, **options: Any) -> None:
    """Print the resolved scenario: every number of a flight, and no name of a file.

    The YAML (or, with --json, JSON) is a scenario file itself: `--scenario` flies it to the same
    bits, wherever the files are that it was made from.

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
