"""Names that joints may have."""

from __future__ import annotations

import re
from collections.abc import Collection, Iterable

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.topics import BASE_AXES

BASE = "base"
"""Name of the base in a robot's file."""
OTHER_MEANINGS = {
    "*": "the pattern of all joints in campaigns",
    **dict.fromkeys(BASE_AXES, "the name of a base axis"),
    **dict.fromkeys(("base", "joints", "all"), "a group of axes in faults"),
    **dict.fromkeys(("time", "q_w", "q_x", "q_y", "q_z"), "a column of trajectories"),
    **{
        f"base_{kind}_{axis}": "a column of disturbances"
        for kind in ("force", "torque")
        for axis in "xyz"
    },
}
"""What names of joints would mean elsewhere."""


def other_meaning(name: str, joints: Collection[str] = ()) -> str:
    """Return what the name of a joint would mean elsewhere; empty: nothing.

    Args:
        name: of the joint.
        joints: names of all moving joints.
    """
    if name.isdecimal():
        return "the number of a joint in faults and campaigns"
    if re.fullmatch(r"(wheel|thruster|torquer)_\d+", name):
        return "the name of an actuator of the base"
    if name.endswith("_rate") and (joint := name.removesuffix("_rate")) in joints:
        return f"the column of the rate of {short(joint)} in trajectories"
    return OTHER_MEANINGS.get(name, "")


def first_repeated(names: Iterable[str]) -> str | None:
    """Return the first repeated name; None if all differ."""
    seen: set[str] = set()
    for name in names:
        if name in seen:
            return name
        seen.add(name)
    return None
