"""The laws of a flight one after the other, and what changes from one to the next."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from space_robot_msgs_py.samples import LawInForce


class LawChange(NamedTuple):
    """From one law to another, or to other gains of the same one."""

    before: LawInForce | None
    """None: the controller begins."""
    law: LawInForce

    def __str__(self) -> str:
        before, law = self
        if before is None:
            return law.name
        if before.name != law.name:
            return f"{before.name} -> {law.name}"
        changed = [gain for gain in law.gains if before.gains.get(gain) != law.gains[gain]]
        return f"{law.name}: other {', '.join(changed)}"


def same(one: LawInForce, other: LawInForce) -> bool:
    """Whether two laws are the same with the same gains, to the last bit."""
    return (
        one.name == other.name
        and one.gains.keys() == other.gains.keys()
        and all(
            np.array_equal(
                np.array(values).view(np.int64), np.array(other.gains[gain]).view(np.int64)
            )
            for gain, values in one.gains.items()
        )
    )
