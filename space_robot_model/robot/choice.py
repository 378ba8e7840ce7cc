"""What is chosen of a URDF, as a part of its name: ``my.urdf?base=LINK&repair``.

One text names a robot to commands, nodes and bags; a YAML that refers to a URDF says the same with
``base`` and ``repair``.
"""

from __future__ import annotations

import re
from typing import NamedTuple
from urllib.parse import quote, unquote

_CHOICE = re.compile(r"\?(?=base=|repair$)(?:base=([^&?./]+))?(?:&?(repair))?$")


class RobotChoice(NamedTuple):
    """A robot's name, taken apart."""

    name: str
    """Without what is chosen."""
    base: str | None
    """The link that is the satellite; None: the root."""
    repair: bool
    """Whether defects are repaired."""


def with_choice(robot: str, base: str | None, repair: bool) -> str:
    """Return the name of a robot of which this is chosen; `split_choice` takes it apart."""
    chosen = [f"base={quote(base, safe='').replace('.', '%2E')}"] if base else []
    chosen += ["repair"] if repair else []
    return f"{robot}?{'&'.join(chosen)}" if chosen else robot


def split_choice(robot: str) -> RobotChoice:
    """Take a robot's name apart; any text is one."""
    match = _CHOICE.search(robot)
    if not match:
        return RobotChoice(robot, None, False)
    return RobotChoice(robot[: match.start()], match[1] and unquote(match[1]), bool(match[2]))
