"""Replay of a recorded flight, as ``space-robot replay``, from Python."""

from __future__ import annotations

from dataclasses import fields
from pathlib import Path
from typing import Any

from space_robot_msgs_py.config.arguments import as_path
from space_robot_msgs_py.config.validation import one_of

from ..flight.replay.run import Replay, ReplayOptions
from ..flight.replay.run import replay as run


def replay(bag: str | Path, **options: Any) -> Replay:
    """Answer the states of a bag by a new controller, and compare its commands bit for bit.

    ``has_passed`` of the result is the verdict, ``report()`` is the output of ``replay --json``.

    Args:
        bag: folder of the recorded flight.
        options: those of `ReplayOptions`: ``controller``, ``gains``, ``parameters`` of the
            controller, ``start_s``, ``end_s``, ...

    Raises:
        InputError: bag or options cannot be used.
        FlightError: the controller failed at the first state.
    """
    allowed = [field.name for field in fields(ReplayOptions) if field.name != "bag"]
    for name in options:
        one_of(name, allowed, "option", " of replay")
    return run(ReplayOptions(as_path(bag, "bag"), **options))
