"""A URDF's base and repair as a part of its name."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st
from paths import DATA

from space_robot_model.robot.choice import RobotChoice, split_choice, with_choice
from space_robot_model.robot.find import find_robot, new_command, robot_as_path, robot_files

ARM = str(DATA / "arm.urdf")
LINKS = st.one_of(st.none(), st.text(min_size=1).filter(lambda text: text.isprintable()))


@given(
    name=st.sampled_from(["my.urdf", "a b/c?d.urdf", "what?.xacro", "mine/", "x?base=.urdf"]),
    base=LINKS,
    repair=st.booleans(),
)
def test_it_is_taken_apart_again(name: str, base: str | None, repair: bool) -> None:
    assert split_choice(with_choice(name, base, repair)) == RobotChoice(name, base, repair)


@given(st.text())
def test_any_text_is_a_name(text: str) -> None:
    assert text.startswith(split_choice(text).name)


@pytest.mark.parametrize(
    ("name", "base"), [(ARM, "hull"), (f"{ARM}?base=fore", "fore"), (f"{ARM}?repair", "hull")]
)
def test_a_robot_is_found_by_it(name: str, base: str) -> None:
    assert find_robot(name).mass[0] == {"hull": 300.0, "fore": 10.0}[base]
    assert robot_files(name).name == "arm"
    assert robot_as_path(name) == name


def test_what_makes_a_mission() -> None:
    assert new_command(f"{ARM}?base=fore&repair").endswith("arm.urdf --base fore --repair")
