"""What is compiled before a flight is said on standard error alone."""

from __future__ import annotations

import pytest

from space_robot.flight import compilation


def test_the_output_of_a_command_stays_clean(capsys: pytest.CaptureFixture[str]) -> None:
    with compilation.compiling("nothing"):
        pass
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("compiling nothing (once an installation")
