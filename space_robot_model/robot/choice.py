"""Options of a URDF as a part of its name: ``my.urdf?base=LINK&repair``.

So one text defines a robot in commands, nodes and bags; a YAML that refers to a URDF has the same
options as keys ``base`` and ``repair``.
"""

from __future__ import annotations

import re
from typing import NamedTuple
from urllib.parse import quote, unquote

_CHOICE = re.compile(r"\?(?=base=|repair$)(?:base=([^&?./]+))?(?:&?(repair))?$")


class RobotChoice(NamedTuple):
    """A robot's name, split into its parts."""

    name: str
    """Name without options."""
    base: str | None
    """Name of the link that is the satellite; None: the root."""
    repair: bool
    """True to repair defects."""


def with_choice(robot: str, base: str | None, repair: bool) -> str:
    """Return the name of a robot with options; `split_choice` is the inverse."""
    chosen = [f"base={quote(base, safe='').replace('.', '%2E')}"] if base else []
    chosen += ["repair"] if repair else []
    return f"{robot}?{'&'.join(chosen)}" if chosen else robot


def split_choice(robot: str) -> RobotChoice:
    """Split a robot's name; any text is accepted."""
    match = _CHOICE.search(robot)
    if not match:
        return RobotChoice(robot, None, False)
    return RobotChoice(robot[: match.start()], match[1] and unquote(match[1]), bool(match[2]))
