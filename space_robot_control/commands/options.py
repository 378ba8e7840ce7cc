"""Options that say what to fly, the same for every command."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import click

Decorator = Callable[[Any], Any]

OPTIONS: dict[str, Decorator] = {
    "controller": click.option(
        "--controller", default="tde_stc", show_default=True,
        help="ctc, ctc_smc, tde_smc, tde_tsmc, tde_stc, or module:Class of your own."),
    "case": click.option(
        "--case", default="1", show_default=True,
        help="1, 2, 3, 4-1, 4-2, or a path to a case's YAML."),
    "gains": click.option(
        "--gains", default="default", show_default=True,
        help="printed, tuned, default (printed where it flies), or a path."),
    "robot": click.option(
        "--robot", default="paper", show_default=True,
        help="paper, seven_joint, or a path to a robot's YAML."),
    "mission": click.option(
        "--mission", default="", help="Mission by name or path [default: the robot's]."),
    "duration": click.option(
        "--duration", type=float, help="Seconds to fly [default: the mission's]."),
    "bag": click.option(
        "--bag", type=click.Path(path_type=Path), help="Folder of the bag to write."),
    "latency": click.option(
        "--command-latency-ticks", type=int, default=0, show_default=True,
        help="Ticks by which the plant applies commands late."),
    "friction": click.option(
        "--friction/--no-friction", default=True, show_default=True,
        help="Joint friction of the case, or none."),
    "json": click.option(
        "--json", "as_json", is_flag=True, help="Print the report as JSON."),
}  # fmt: skip


def flight_options(*names: str) -> Decorator:
    """Give a command the named options, in that order."""

    def decorate(function: Any) -> Any:
        for name in reversed(names):
            function = OPTIONS[name](function)
        return function

    return decorate
