"""What comes of a command in the test's own process (fixture `space_robot`), and of a program."""

from __future__ import annotations

import subprocess
from collections.abc import Callable, Sequence
from typing import Any, NamedTuple


class Ran(NamedTuple):
    code: int
    out: str
    err: str


Run = Callable[..., Ran]


def run_program(words: Sequence[str], **options: Any) -> subprocess.CompletedProcess[str]:
    """Run a program to its end; ``options``: of `subprocess.run`."""
    return subprocess.run(words, capture_output=True, text=True, check=False, **options)
