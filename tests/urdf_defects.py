"""URDFs with one defect each, and what is said of it."""

from __future__ import annotations

import re
from typing import NamedTuple

from paths import DATA

GOOD = (DATA / "arm.urdf").read_text()
HULL = re.search(r"    <inertial>.*?</inertial>\n", GOOD, re.DOTALL)[0]  # type: ignore[index]
UPPER = GOOD[GOOD.index('<link name="upper">') :].split("</inertial>")[0].split(">", 1)[1]
FORE = '<mass value="10"/>'
FLAT = '<inertia ixx="1" ixy="0" ixz="0" iyy="1" iyz="0" izz="0.2"/>'
LIMIT = '<limit lower="-1" upper="2" velocity="0.1" effort="50"/>'
STRAY = '<link name="stray"><inertial><mass value="1"/></inertial></link>\n</robot>'


class Defect(NamedTuple):
    """What is written in the place of something else, and what is said about it."""

    old: str
    new: str
    part: str
    line: int
    text: str
    repair: str = ""
    """Empty: it has none."""


DEFECTS = {
    # what is no URDF at all
    "empty file": Defect(GOOD, " \n", "", 0, "the file is empty"),
    "not XML": Defect("</inertial>", "", "", 15, "not XML (mismatched tag)"),
    "document type": Defect("<robot", "<!DOCTYPE x>\n<robot", "", 2, "<!DOCTYPE>"),
    "nested too deep": Defect(GOOD, "<a>" * 200 + "</a>" * 200, "", 1, "nested deeper"),
    "another root": Defect(GOOD, "<sdf><robot/></sdf>", "<sdf>", 1, "the root must be <robot>"),
    "xacro element": Defect("</robot>", "<xacro:x/></robot>", "<xacro:x>", 57, "xacro must be"),
    "robot without name": Defect(
        '<robot name="arm">', "<robot>", "robot", 2, "a printable name is required", "named 'given'"
    ),
    "no link": Defect(GOOD, '<robot name="a"/>', "robot", 1, "there is no <link>"),
    "no joint": Defect(
        GOOD, f'<robot name="a"><link name="b">{HULL}</link></robot>', "", 0, "no moving joint"
    ),
    # names, and what hangs on what
    "link without name": Defect('<link name="upper">', "<link>", "link", 16, "a printable name"),
    "unprintable name": Defect('<link name="upper">', '<link name="&#10;">', "link", 16, "name"),
    "joint without name": Defect('name="slide" ', "", "joint", 45, "a printable name"),
    "two links of a name": Defect(
        'link name="fore"', 'link name="upper"', "link 'upper'", 24, "taken by the link in line 16"
    ),
    "two joints of a name": Defect(
        'joint name="slide"', 'joint name="wrist"', "joint 'wrist'", 52, "the joint in line 45"
    ),
    "name of a base axis": Defect(
        'joint name="slide"', 'joint name="base_x"', "joint 'base_x'", 45, "name of a base axis"
    ),
    "name of a column": Defect(
        'joint name="slide"', 'joint name="time"', "joint 'time'", 45, "a column of trajectories"
    ),
    "name of all": Defect(
        'joint name="slide"', 'joint name="*"', "joint '*'", 45, "pattern of all joints"
    ),
    "number of a joint": Defect('joint name="slide"', 'joint name="2"', "joint '2'", 45, "number"),
    "no parent": Defect('<parent link="upper"/>', "", "joint 'slide'", 45, "<parent link="),
    "no child": Defect('<child link="fore"/>', "<child/>", "joint 'slide'", 45, "<child link="),
    "unknown parent": Defect(
        '<parent link="upper"/>', '<parent link="x"/>', "joint 'slide'", 47, "is not a known link"
    ),
    "unknown child": Defect(
        '<child link="fore"/>', '<child link="x"/>', "joint 'slide'", 48, "is not a known link"
    ),
    "parent is child": Defect(
        '<child link="fore"/>',
        '<child link="upper"/>',
        "joint 'slide'",
        45,
        "must be different links",
    ),
    "two parents": Defect(
        '<child link="hand"/>',
        '<child link="upper"/>',
        "joint 'wrist'",
        52,
        "already: loops cannot be closed",
    ),
    "two roots": Defect("</robot>", STRAY, "link 'stray'", 57, "only the root may have no parent"),
    "circle": Defect(
        '<parent link="hull"/>', '<parent link="hand"/>', "joint 'shoulder'", 37, "form a loop"
    ),
    # joints
    "no type": Defect(' type="prismatic"', "", "joint 'slide'", 45, "type must be one of"),
    "unknown type": Defect('"prismatic"', '"screw"', "joint 'slide'", 45, "type must be one of"),
    "planar joint": Defect(
        '"prismatic"', '"planar"', "joint 'slide'", 45, "more than one degree of freedom"
    ),
    "floating joint": Defect(
        '"prismatic"', '"floating"', "joint 'slide'", 45, "more than one degree of freedom"
    ),
    "mimic": Defect(
        LIMIT,
        f'{LIMIT}<mimic joint="slide"/>',
        "joint 'shoulder'",
        42,
        "cannot be coupled",
        "made independent",
    ),
    "zero axis": Defect('"0 1 0"', '"0 0 0"', "joint 'shoulder'", 41, "the axis has no direction"),
    "axis of NaN": Defect('"0 1 0"', '"0 nan 0"', "joint 'shoulder'", 41, "is not a number"),
    "axis of two numbers": Defect('"0 1 0"', '"0 1"', "joint 'shoulder'", 41, "must be 3 numbers"),
    "long axis": Defect(
        '"0 1 0"', '"0 1 1"', "joint 'shoulder'", 41, "must have length 1", "normalised"
    ),
    "no limit": Defect(LIMIT, "", "joint 'shoulder'", 37, "needs a <limit>", "no limits"),
    "limits upside down": Defect(
        '"-1" upper="2"', '"2" upper="-1"', "joint 'shoulder'", 42, "above upper", "exchanged"
    ),
    "limits without room": Defect(
        'lower="-1" upper="2" ', "", "joint 'shoulder'", 42, "are equal", "no limits of position"
    ),
    "no effort": Defect(
        ' effort="50"', "", "joint 'shoulder'", 42, "limit.effort must be", "no limit of effort"
    ),
    "negative velocity": Defect(
        '"0.1" e', '"-0.1" e', "joint 'shoulder'", 42, "limit.velocity must be", "made positive"
    ),
    "negative damping": Defect(
        '"0.4"', '"-0.4"', "joint 'shoulder'", 43, "dynamics.damping must be", "read as 0"
    ),
    "negative friction": Defect(
        '"0.3"', '"-0.3"', "joint 'shoulder'", 43, "dynamics.friction must be", "read as 0"
    ),
    # numbers and what is misspelt
    "text for a number": Defect(
        '"0 0 0.8"', '"0 0 0,8"', "joint 'slide'", 46, "origin.xyz is not a number, got '0,8'"
    ),
    "too large": Defect('"300"', '"1e13"', "link 'hull'", 7, "must be at most 1e+12"),
    "infinite": Defect('"300"', '"1e400"', "link 'hull'", 7, "must be at most 1e+12"),
    "no mass value": Defect(FORE, "<mass/>", "link 'fore'", 26, "needs the attribute 'value'"),
    "no moment": Defect(' iyy="50"', "", "link 'hull'", 8, "<inertia> needs the attribute 'iyy'"),
    "no product": Defect(' iyz="0" izz="60"', ' izz="60"', "link 'hull'", 8, "needs 'iyz'", "read"),
    "misspelt element": Defect(
        '<dynamics damping="0.4" friction="0.3"/>',
        "<dynamcis/>",
        "joint 'shoulder'",
        43,
        "unknown element <dynamcis>",
        "left out",
    ),
    "misspelt attribute": Defect(
        'damping="0.4"',
        'damp="0.4"',
        "joint 'shoulder'",
        43,
        "unknown attribute 'damp'",
        "left out",
    ),
    "given twice": Defect(
        LIMIT, LIMIT * 2, "joint 'shoulder'", 42, "<limit> occurs twice", "the first one"
    ),
    # masses and inertias
    "negative mass": Defect('"300"', '"-300"', "link 'hull'", 7, "mass must be at least 0"),
    "root without inertia": Defect(
        HULL,
        "",
        "link 'hull'",
        4,
        "the base must have a mass",
        "joint 'shoulder' locked at 0, merged into link 'upper'",
    ),
    "massless tip": Defect(
        FORE,
        '<mass value="0"/>',
        "link 'fore'",
        26,
        "a moving link must have a mass",
        "joint 'slide' locked at 0, merged into link 'upper'",
    ),
    "massless between": Defect(
        UPPER, "<inertial>", "link 'upper'", 16, "a moving link that carries others must"
    ),
    "inertia without mass": Defect(
        "</link>\n  <joint",
        f"<inertial>{FLAT}</inertial></link>\n  <joint",
        "link 'hand'",
        36,
        "inertia without mass",
        "the inertia is ignored",
    ),
    "zero inertia": Defect(
        FLAT, "", "link 'fore'", 26, "the inertia is zero", "that of a solid sphere of 0.134 m"
    ),
    "zero inertia, a shape": Defect(
        '<inertia ixx="2" ixy="0.1" ixz="0" iyy="2" iyz="0" izz="0.5"/>',
        "",
        "link 'upper'",
        19,
        "the inertia is zero",
        "that of the solid cylinder of its visual",
    ),
    "not positive definite": Defect(
        'iyy="50"', 'iyy="-5"', "link 'hull'", 7, "not positive definite", "raised to the nearest"
    ),
    "triangle inequality": Defect(
        'izz="60"',
        'izz="95"',
        "link 'hull'",
        7,
        "breaks the triangle inequality",
        "raised to the nearest physical one, principal moments 42.55, 52.55, 95",
    ),
    # shapes
    "shape without size": Defect(
        '<sphere radius="0.1"/>',
        "<sphere/>",
        "link 'hand'",
        32,
        "needs the attribute 'radius'",
        "the shape is ignored",
    ),
    "negative shape": Defect(
        '"1 1 2"', '"1 1 -2"', "link 'hull'", 10, "must have sizes above 0", "the shape is ignored"
    ),
    "unknown shape": Defect(
        '<box size="1 1 2"/>', "<cone/>", "link 'hull'", 10, "must be box, cylinder", "the shape"
    ),
    "no geometry": Defect(
        '<geometry><box size="1 1 2"/></geometry>', "", "link 'hull'", 10, "one <geometry>", "the"
    ),
    "mesh without file": Defect(
        'filename="package://arm/fore.stl" ',
        "",
        "link 'fore'",
        29,
        "a mesh needs a filename",
        "the shape is ignored",
    ),
    "colour": Defect(
        '"0.2 0.2 0.2 1"', '"grey"', "material 'grey'", 3, "must be 4 numbers", "the colour"
    ),
}


def with_defect(name: str) -> str:
    """The good URDF with that defect."""
    defect = DEFECTS[name]
    assert GOOD.count(defect.old) or not defect.line
    return GOOD.replace(defect.old, defect.new, 1)
