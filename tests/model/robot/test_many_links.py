"""Files far too large: refused by counting, before anything is computed for each link.

Not a time is asserted but what is read: of a file that has too much nothing is.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

from space_robot_model.robot import Robot
from space_robot_model.robot.file import MOST_LINKS
from space_robot_model.robot.tree import first_repeated
from space_robot_model.robot.urdf.read import MOST_MOVING, parse_urdf
from space_robot_msgs_py.errors import InputError

MATTER = (
    '<inertial><mass value="1"/>'
    '<inertia ixx="1" iyy="1" izz="1" ixy="0" ixz="0" iyz="0"/></inertial>'
)


def urdf(links: int, kind: str, matter: str = MATTER) -> str:
    """A chain."""
    joints = "".join(
        f'<link name="l{k}">{matter}</link><joint name="j{k}" type="{kind}"><parent link="l{k - 1}"'
        f'/><child link="l{k}"/></joint>'
        for k in range(1, links)
    )
    return f'<robot name="long"><link name="l0">{MATTER}</link>{joints}</robot>'


@pytest.mark.parametrize(
    ("text", "said"),
    [
        (urdf(MOST_LINKS + 1, "revolute"), "at most 4000 links can be read, got 4001"),
        (urdf(MOST_LINKS + 1, "fixed"), "at most 4000 links can be read, got 4001"),
        (urdf(MOST_MOVING + 2, "continuous", ""), "at most 64 moving joints .* got 257"),
    ],
)
def test_a_urdf_is_counted_first(text: str, said: str, monkeypatch: pytest.MonkeyPatch) -> None:
    def read(*_: Any) -> None:
        raise AssertionError("a link was read")

    monkeypatch.setattr("space_robot_model.robot.urdf.read.read_links", read)
    with pytest.raises(InputError, match=said):
        parse_urdf(text, Path("my.urdf"))


def test_what_can_be_locked_still_counts_as_read() -> None:
    """More moving joints than can be flown, of which all but one carry nothing that has mass."""
    text = urdf(2, "continuous").replace(
        "</robot>",
        "".join(
            f'<link name="tip{k}"/><joint name="t{k}" type="continuous"><parent link="l1"/>'
            f'<child link="tip{k}"/></joint>'
            for k in range(80)
        )
        + "</robot>",
    )
    robot = Robot.of_tree("tips", parse_urdf(text, Path("my.urdf"), repair=True).bodies)
    assert (robot.n, len(robot.tools)) == (1, 80)


def test_a_yaml_is_counted_before_its_links_are_compared() -> None:
    link = {"mass": 1.0, "inertia": [1.0] * 3 + [0.0] * 3, "com": [0.0] * 3}
    content: dict[str, Any] = {
        "name": "long",
        "base": {"mass": 1.0, "inertia": link["inertia"]},
        "links": [{"name": f"j{k}", **link} for k in range(MOST_LINKS + 1)],
    }
    with pytest.raises(InputError, match="links: List should have at most 4000 items"):
        Robot.from_dict({"robot": content})


@pytest.mark.parametrize(
    ("names", "repeated"), [([], None), ("ab", None), ("aba", "a"), ("abb", "b"), ("abcbab", "b")]
)
def test_the_first_name_that_is_taken(names: list[str], repeated: str | None) -> None:
    assert first_repeated(names) == repeated
