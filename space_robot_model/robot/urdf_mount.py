"""Mounting of an arm on a satellite: one URDF of two, with a fixed joint between their roots.

Most published URDFs of arms stand on a root link without mass, which is fixed to the ground.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from .urdf import expand_urdf
from .urdf_joints import read_joints
from .urdf_links import MOMENTS, read_colours, read_links, with_absolute_meshes
from .urdf_tree import build_tree, mend_inertias
from .urdf_xml import Element, Report, parse_xml

NAMES = {
    ("link", "name"): "link",
    ("parent", "link"): "link",
    ("child", "link"): "link",
    ("joint", "name"): "joint",
    ("mimic", "joint"): "joint",
    ("material", "name"): "material",
}
"""What the attributes of elements name."""


@dataclass(frozen=True)
class Mount:
    """A satellite, and the place of an arm's root on it."""

    satellite: Path | None
    """URDF or xacro file; None: a rigid body of ``mass`` and ``inertia``."""
    mass: float = 0.0
    """kg."""
    inertia: Sequence[float] = ()
    """``[Ixx, Iyy, Izz, Ixy, Ixz, Iyz]`` about its centre of mass, kg m2."""
    xyz: Sequence[float] = (0.0, 0.0, 0.0)
    """Position of the arm's root in the frame of the satellite's, m."""
    rpy: Sequence[float] = (0.0, 0.0, 0.0)
    """Roll, pitch and yaw of the arm's root about fixed axes, rad."""


class Mounted(NamedTuple):
    """A URDF of an arm on a satellite."""

    name: str
    text: str


def mounted_urdf(arm: Path, mount: Mount, repair: bool) -> Mounted:
    """Return the URDF of an arm on a satellite.

    Links, joints and materials of the arm whose names the satellite has are called ``arm_<name>``.

    Args:
        arm: URDF or xacro file.
        mount: the satellite, and where the arm is on it.
        repair: whether defects are repaired, when the text is read.

    Raises:
        InputError: a file is not a URDF, or has a defect; names file, line, link or joint.
    """
    satellite, seat = _read(mount.satellite, repair) if mount.satellite else _body(mount)
    own, foot = _read(arm, repair)
    taken, names = (
        {(part.tag, part.attributes.get("name", "")) for part in root.children}
        for root in (satellite, own)
    )
    new_names = {}
    for tag, name in names:
        new = name
        # arm_x may be the name of another link of the arm
        while (tag, new) in taken or (new != name and (tag, new) in names):
            new = f"arm_{new}"
        new_names[tag, name] = new
    joint, whole = "mount", f"{arm.stem}_on_{mount.satellite.stem if mount.satellite else seat}"
    while ("joint", joint) in taken | names:
        joint = f"arm_{joint}"
    origin = {"xyz": _words(mount.xyz), "rpy": _words(mount.rpy)}
    ends = {"parent": seat, "child": new_names["link", foot]}
    fixed = Element("joint", 0, {"name": joint, "type": "fixed"}, [Element("origin", 0, origin)])
    fixed.children += [Element(end, 0, {"link": link}) for end, link in ends.items()]
    parts = [*satellite.children, *(_renamed(part, new_names) for part in own.children), fixed]
    robot = Element("robot", 0, {"name": whole}, parts)
    return Mounted(whole, f'<?xml version="1.0"?>\n{_text(robot)}')


def _read(file: Path, repair: bool) -> tuple[Element, str]:
    """Return a URDF's links, joints and materials, and the name of its root link."""
    report = Report(str(file))
    text = with_absolute_meshes(expand_urdf(file), file.absolute().parent)
    root = parse_xml(text, report.where)
    links = read_links(root, read_colours(root, report), file.absolute().parent, report)
    tree = build_tree(links, read_joints(root, links, report), None, report.where)
    mend_inertias(links, tree)
    if not repair:
        report.refuse_defects()
    parts = [part for part in root.children if part.tag in ("link", "joint", "material")]
    return replace(root, children=parts), tree.base


def _body(mount: Mount) -> tuple[Element, str]:
    values = dict(zip(MOMENTS, map(repr, mount.inertia), strict=True))
    mass = Element("mass", 0, {"value": repr(mount.mass)})
    inertial = Element("inertial", 0, {}, [mass, Element("inertia", 0, values)])
    link = Element("link", 0, {"name": "satellite"}, [inertial])
    return Element("robot", 0, {}, [link]), "satellite"


def _renamed(element: Element, new_names: Mapping[tuple[str, str], str]) -> Element:
    attributes = {
        key: new_names.get((NAMES.get((element.tag, key), ""), value), value)
        for key, value in element.attributes.items()
    }
    children = [_renamed(child, new_names) for child in element.children]
    return replace(element, attributes=attributes, children=children)


def _words(values: Sequence[float]) -> str:
    return " ".join(map(repr, values))


def _text(element: Element, indent: str = "") -> str:
    words = "".join(f" {key}={quoteattr(value)}" for key, value in element.attributes.items())
    if not element.children:
        return f"{indent}<{element.tag}{words}/>\n"
    inner = "".join(_text(child, f"{indent}  ") for child in element.children)
    return f"{indent}<{element.tag}{words}>\n{inner}{indent}</{element.tag}>\n"
