"""Text of a URDF for any robot, for RViz, Pinocchio and MuJoCo.

Frames of links are those of `space_robot_model.robot.placements`: the root is the base, at its
centre of mass, and the z axis of every other frame is the axis of its joint. A tool is a massless
link on a fixed joint.

URDF has no elements for springs (their damping becomes the joint's), gears, plates, wheels,
thrusters and sensors, nor for the rank of tools.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from pathlib import Path
from typing import NamedTuple
from urllib.parse import quote
from xml.etree.ElementTree import Element, SubElement, indent, tostring

import numpy as np

from ..elementary.matrices import Array, product
from ..elementary.rotations import rpy_of_rotation
from .inertia import inertia_elements
from .parts import Base, Body, Colour, Visual
from .placements import distinct, frame_names, plain_name, urdf_joint_names
from .robot import Robot
from .shapes import shapes_of
from .urdf_links import MOMENTS
from .urdf_xml import LARGEST

Materials = dict[Colour, str]


def urdf_text(robot: Robot, name: str = "") -> str:
    """Return the URDF text of a robot, the same for equal robots.

    Joints keep their names, links have those of `frame_names`. Shapes are those of `shapes_of`.

    Args:
        robot: with any tree of joints.
        name: in the URDF; the robot's name if empty.
    """
    frames = frame_names(robot)
    shapes = shapes_of(robot)
    colours = dict.fromkeys(shape.colour for shape in shapes if shape.colour)
    materials = {colour: f"colour_{number + 1}" for number, colour in enumerate(colours)}
    root = Element("robot", name=plain_name(name or robot.name))
    for colour, material in materials.items():
        SubElement(SubElement(root, "material", name=material), "color", rgba=_words(colour))
    joints = urdf_joint_names(robot)
    taken = {*joints, *frames.bodies, *frames.tools}
    tree, numbers = robot.tree, (0, *(joint + 1 for joint in robot.order))
    parts: list[Base | Body] = [tree.base, *tree.links]
    for body, part in zip(numbers, parts, strict=True):
        if isinstance(part, Body):
            parent, child = frames.bodies[robot.parent[body - 1]], frames.bodies[body]
            _add_joint(root, part, _Ends(joints[body - 1], parent, child))
        link = SubElement(root, "link", name=frames.bodies[body])
        _add_inertial(link, part)
        for shape in shapes:
            if shape.body == body:
                _add_visual(link, shape, materials)
    for tool, frame in zip(robot.tools, frames.tools, strict=True):
        ends = _Ends(distinct(f"{frame}_joint", "_", taken), frames.bodies[tool.body], frame)
        _joint(root, ends, "fixed", tool.rotation, tool.position)
        SubElement(root, "link", name=frame)
    indent(root)
    return f'<?xml version="1.0"?>\n{tostring(root, encoding="unicode")}\n'


class _Ends(NamedTuple):
    """Name of a joint, and of the links that it connects."""

    joint: str
    parent: str
    child: str


def _joint(root: Element, ends: _Ends, kind: str, rotation: Array, position: Array) -> Element:
    joint = SubElement(root, "joint", name=ends.joint, type=kind)
    _add_origin(joint, rotation, position)
    SubElement(joint, "parent", link=ends.parent)
    SubElement(joint, "child", link=ends.child)
    return joint


def _add_joint(root: Element, link: Body, ends: _Ends) -> None:
    limits, kind = link.limits, _kind(link)
    element = _joint(root, ends, kind, link.rotation, product(link.rotation, link.offset))
    SubElement(element, "axis", xyz="0 0 1")
    numbers = limits._asdict()
    if kind == "continuous":
        numbers = {"velocity": limits.velocity, "effort": limits.effort}
    if kind != "continuous" or any(map(math.isfinite, numbers.values())):
        SubElement(element, "limit", {key: _bound(value) for key, value in numbers.items()})
    if link.friction or link.passive:
        coulomb, viscous = link.friction or (0.0, 0.0)
        damping = link.passive.damping if link.passive else viscous
        SubElement(element, "dynamics", damping=_word(damping), friction=_word(coulomb))


def _kind(link: Body) -> str:
    if link.joint == "prismatic":
        return "prismatic"
    is_limited = math.isfinite(link.limits.lower) or math.isfinite(link.limits.upper)
    return "revolute" if is_limited else "continuous"


def _add_inertial(link: Element, part: Base | Body) -> None:
    inertial = SubElement(link, "inertial")
    _add_origin(inertial, np.eye(3), part.com)
    SubElement(inertial, "mass", value=_word(part.mass))
    elements = map(_word, inertia_elements(part.inertia))
    SubElement(inertial, "inertia", dict(zip(MOMENTS, elements, strict=True)))


def _add_visual(link: Element, shape: Visual, materials: Materials) -> None:
    visual = SubElement(link, "visual")
    _add_origin(visual, shape.rotation, shape.position)
    geometry = SubElement(visual, "geometry")
    if shape.shape == "mesh":
        SubElement(geometry, "mesh", filename=mesh_address(shape.mesh), scale=_words(shape.size))
    elif shape.shape == "box":
        SubElement(geometry, "box", size=_words(shape.size))
    else:
        sizes = zip(("radius", "length"), map(_word, shape.size), strict=False)
        SubElement(geometry, shape.shape, dict(sizes))
    if shape.colour:
        SubElement(visual, "material", name=materials[shape.colour])


def mesh_address(mesh: str) -> str:
    """Return the URL of a mesh file, since viewers do not know the folder of a relative path."""
    return mesh if "://" in mesh else f"file://{quote(str(Path(mesh).absolute()))}"


def _add_origin(element: Element, rotation: Array, position: Array) -> None:
    SubElement(element, "origin", xyz=_words(position), rpy=_words(rpy_of_rotation(rotation)))


def _bound(limit: float) -> str:
    # other readers of URDF do not accept inf; `urdf_xml` reads this number as infinite
    return _word(limit if math.isfinite(limit) else math.copysign(LARGEST, limit))


def _words(values: Iterable[float]) -> str:
    return " ".join(map(_word, values))


def _word(value: float) -> str:
    """Return the shortest text that is read as the same float, without a negative zero."""
    return repr(float(value) + 0.0).removesuffix(".0")
