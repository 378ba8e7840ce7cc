"""Commands that have moved: one line on what to use instead, and exit code 2."""

from __future__ import annotations

import pytest
from command import Run

from space_robot.cli.main import cli


@pytest.mark.parametrize(
    ("line", "instead"), [("soak --minutes 5 --json", "make soak ARGS=... in the repository")]
)
def test_a_moved_command_says_what_to_use(space_robot: Run, line: str, instead: str) -> None:
    ended = space_robot(*line.split())
    assert (ended.code, ended.out) == (2, "")
    (told,) = ended.err.splitlines()
    assert instead in told
    assert cli.commands[line.split()[0]].hidden
