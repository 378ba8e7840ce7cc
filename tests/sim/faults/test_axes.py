"""Axes by name, by number and in groups; robots may call their joints what they like."""

from __future__ import annotations

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import RobotNames
from space_robot_msgs_py.topics import BASE_AXES
from space_robot_sim.faults.axes import About, axes_of

JOINTS = st.lists(st.text(min_size=1, max_size=5), min_size=1, max_size=9, unique=True)
PAPER = RobotNames(tuple(f"joint_{k}" for k in range(1, 7)))


@given(JOINTS)
def test_every_name_is_its_own_axis(joints: list[str]) -> None:
    """A joint named ``2``, ``all`` or ``base`` too: what has a name is called by it."""
    names = RobotNames(tuple(joints))
    for place, name in enumerate(names.axes):
        if names.axes.count(name) == 1:
            assert axes_of(name, About.AXIS, names) == (place,)
            if place >= len(BASE_AXES):
                assert axes_of(name, About.JOINT, names) == (place,)


@pytest.mark.parametrize(
    ("name", "axes"),
    [
        ("base_y", (1,)),
        ("joint_3", (5,)),
        ("3", (5,)),
        ("6", (8,)),
        ("base", (0, 1, 2)),
        ("joints", (3, 4, 5, 6, 7, 8)),
        ("all", tuple(range(9))),
    ],
)
def test_names_numbers_and_groups(name: str, axes: tuple[int, ...]) -> None:
    assert axes_of(name, About.AXIS, PAPER) == axes
    if axes[0] >= 3:
        assert axes_of(name, About.JOINT, PAPER) == axes


@pytest.mark.parametrize("name", ["", "0", "7", "03", "-1", "base_w", "Joint_1"])
def test_an_axis_that_is_not_there_is_named_with_those_that_are(name: str) -> None:
    allowed = "choose one of base_x, base_y, base_z, joint_1, .*, 1 to 6, base, joints, all( |$)"
    with pytest.raises(InputError, match=f"^no axis '{name}': {allowed}"):
        axes_of(name, About.AXIS, PAPER)


@pytest.mark.parametrize(("name", "axes"), [("base_y", (1,)), ("base", (0, 1, 2))])
def test_axes_of_the_base_alone(name: str, axes: tuple[int, ...]) -> None:
    assert axes_of(name, About.BASE_AXIS, PAPER) == axes


@pytest.mark.parametrize("name", ["1", "joint_1", "joints", "all"])
def test_a_joint_is_no_base_axis(name: str) -> None:
    allowed = "choose one of base_x, base_y, base_z, base( |$)"
    with pytest.raises(InputError, match=f"^no base axis '{name}': {allowed}"):
        axes_of(name, About.BASE_AXIS, PAPER)


@pytest.mark.parametrize("name", ["base", "base_x", "all"])
def test_a_base_axis_is_no_joint(name: str) -> None:
    with pytest.raises(
        InputError, match=f"^no joint '{name}': choose one of joint_1, .*, joints( |$)"
    ):
        axes_of(name, About.JOINT, PAPER)


HARDWARE = RobotNames(PAPER.joints, ("wheel_1", "wheel_2"), ("thruster_1",))


def test_wheels_and_thrusters_are_counted_among_their_like() -> None:
    for name, places in (("wheel_2", (1,)), ("1", (0,)), ("wheels", (0, 1))):
        assert axes_of(name, About.WHEEL, HARDWARE) == places
    for name in ("thruster_1", "1", "thrusters"):
        assert axes_of(name, About.THRUSTER, HARDWARE) == (0,)


@pytest.mark.parametrize("name", ["3", "thruster_1", "all", "joint_1"])
def test_a_wheel_that_is_not_there(name: str) -> None:
    allowed = "choose one of wheel_1, wheel_2, 1 to 2, wheels( |$)"
    with pytest.raises(InputError, match=f"^no wheel '{name}': {allowed}"):
        axes_of(name, About.WHEEL, HARDWARE)
    with pytest.raises(InputError, match=f"^no thruster '{name}': there is none$"):
        axes_of(name, About.THRUSTER, PAPER)
