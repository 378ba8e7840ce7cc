"""Commands that have moved: one line on what to use instead, and exit code 2."""

from __future__ import annotations

import pytest
from command import Run

from space_robot.cli.main import cli


@pytest.mark.parametrize(
    ("line", "instead"),
    [
        ("sweep", "space-robot campaign run sensor_grades --out campaigns/sensor_grades"),
        (
            "sweep --draws 2 --seed 7 --jobs 1 --out a",
            "space-robot campaign run sensor_grades --runs 8 --seed 7 --workers 1 --out a",
        ),
        (
            "sweep --actuators ideal --actuators none --law ctc --law=tde_stc --spread 0.2 --json",
            "space-robot campaign run base_actuators --out campaigns/base_actuators "
            "(--law, --spread, --json: in a copy of ",
        ),
    ],
)
def test_a_moved_command_says_what_to_use(space_robot: Run, line: str, instead: str) -> None:
    ended = space_robot(*line.split())
    assert (ended.code, ended.out) == (2, "")
    (told,) = ended.err.splitlines()
    assert instead in told
    assert cli.commands[line.split()[0]].hidden
