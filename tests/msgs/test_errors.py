"""Errors on their way from one process to another."""

from __future__ import annotations

import pickle
import re
from importlib import import_module
from pathlib import Path
from typing import Any

import pytest
from paths import ROOT

from space_robot.flight.graph.following import InterruptedFlightError
from space_robot_control.flight_code.c99.language import NotInSubsetError
from space_robot_msgs_py.errors import (
    DivergedError,
    MessageError,
    SingularAttitudeError,
    SpaceRobotError,
    UnusableStateError,
)
from space_robot_msgs_py.ros.locks import HeldError, Holder

MADE: dict[type[SpaceRobotError], SpaceRobotError] = {
    DivergedError: DivergedError(11, 0.0005, "why"),
    UnusableStateError: UnusableStateError(3, "is not finite", "not finite"),
    SingularAttitudeError: SingularAttitudeError(4),
    MessageError: MessageError("text", "late"),
    NotInSubsetError: NotInSubsetError("law.py", 12, "recursion", "write a loop"),
    HeldError: HeldError(Path("lock"), Holder("plant (pid 1)", 2)),
    InterruptedFlightError: InterruptedFlightError("stopped", 2),
}
"""Those whose constructors want more than a text."""


def kinds() -> list[type[SpaceRobotError]]:
    """All there are, once the modules that define some are imported."""
    root = ROOT
    for file in root.glob("space_robot*/**/*.py"):
        if re.search(r"^class \w+Error\(", file.read_text("utf-8"), re.MULTILINE):
            import_module(".".join(file.relative_to(root).with_suffix("").parts))
    return _below(SpaceRobotError)


def _below(kind: type[SpaceRobotError]) -> list[type[SpaceRobotError]]:
    return [kind, *(other for sub in kind.__subclasses__() for other in _below(sub))]


@pytest.mark.parametrize("kind", kinds(), ids=lambda kind: kind.__name__)
def test_it_arrives_as_it_left(kind: type[SpaceRobotError]) -> None:
    error: Any = MADE.get(kind) or kind("text")
    error.log = "what was flown"
    arrived = pickle.loads(pickle.dumps(error))
    assert type(arrived) is kind
    assert str(arrived) == str(error)
    assert vars(arrived) == vars(error)
    assert arrived.exit_code == error.exit_code
