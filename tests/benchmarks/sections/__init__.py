"""The sections, one file each.

A new one: a file here with a function of its name from `Options` to a list of `Result`, and its
name in `command.SECTIONS`. A section is imported when it runs: some need what others do not, ROS
or the peers.
"""

from __future__ import annotations

from collections.abc import Callable
from importlib import import_module

from ..measure import Options
from ..result import Result

Section = Callable[[Options], list[Result]]


def section(name: str) -> Section:
    """The function of a section."""
    word = name.replace("-", "_")
    found: Section = getattr(import_module(f"{__name__}.{word}"), word)
    return found
