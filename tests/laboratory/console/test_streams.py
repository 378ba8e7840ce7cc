"""Errors of standard output are told from those of files, and standard error may lose its words."""

from __future__ import annotations

import errno
import os
import sys
from pathlib import Path

import pytest

from space_robot.console.streams import is_of_output, standard_streams

WRITING = [errno.EPIPE, errno.ENOSPC, errno.EIO]


@pytest.mark.parametrize("number", WRITING)
def test_an_error_of_a_file_is_not_one_of_the_output(number: int) -> None:
    assert not is_of_output(OSError(number, "why", "a_file"))


def test_an_error_that_is_not_about_writing_is_not_one_of_the_output() -> None:
    assert not is_of_output(OSError(errno.EACCES, "why"))
    assert not is_of_output(ConnectionRefusedError(errno.ECONNREFUSED, "why"))


@pytest.mark.parametrize("number", WRITING)
def test_what_a_full_output_holds_goes_nowhere(
    number: int, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "output"
    with path.open("w") as output:
        monkeypatch.setattr(sys, "stdout", output)
        output.write("held back")
        assert is_of_output(OSError(number, "why"))
        output.flush()
    assert path.read_text() == ""


def test_words_that_standard_error_does_not_take_are_lost(monkeypatch: pytest.MonkeyPatch) -> None:
    reader, writer = os.pipe()
    os.close(reader)
    with os.fdopen(writer, "w", buffering=1) as closed:
        monkeypatch.setattr(sys, "stderr", closed)
        with standard_streams():
            assert sys.stderr.write("nobody reads this\n") == 18
            sys.stderr.flush()
