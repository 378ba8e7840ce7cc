"""Reading of a robot from a URDF file, and mounting of an arm on a satellite.

Most published URDFs of arms stand on a root link without mass, which is fixed to the ground. The
mount makes one URDF of two, with a fixed joint between their roots.
"""

from __future__ import annotations

import contextlib
import io
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import NamedTuple
from xml.sax.saxutils import quoteattr

from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.config.yaml_text import check_readable, read_file
from space_robot_msgs_py.errors import InputError

from ..dynamics.model import MOST_JOINTS
from .names import first_repeated, other_meaning
from .parts import MOST_LINKS, RobotTree
from .urdf_joints import read_joints
from .urdf_links import MOMENTS, read_colours, read_links, with_absolute_meshes
from .urdf_tree import (
    Tree,
    build_tree,
    check_kinds,
    end_frames,
    make_tree,
    mend_inertias,
    mend_massless,
    moved_frames,
)
from .urdf_xml import Element, Fields, Finding, Report, UrdfFrame, parse_xml, short_tag

XACRO = ".xacro"
MOST_MOVING = 4 * MOST_JOINTS
"""Maximum number of joints that are not fixed; massless ones are locked later."""
NAMED_KINDS = {
    ("link", "name"): "link",
    ("parent", "link"): "link",
    ("child", "link"): "link",
    ("joint", "name"): "joint",
    ("mimic", "joint"): "joint",
    ("material", "name"): "material",
}
"""Kind of what the attributes of elements name."""


@dataclass(frozen=True)
class UrdfRobot:
    """Content of a URDF."""

    tree: RobotTree
    """One link for each of the file, in the order of their joints."""
    findings: tuple[Finding, ...]
    """Repaired defects."""
    text: str
    """Text of the URDF, expanded if it was xacro."""
    frames: Mapping[str, UrdfFrame]
    """Frames of bodies relative to their links', where they differ."""


def read_urdf(
    path: str | Path,
    base: str | None = None,
    repair: bool = False,
    tools: Sequence[str] | None = None,
    text: str | None = None,
) -> UrdfRobot:
    """Read a URDF file, or a xacro file if that package is installed.

    Args:
        path: of the file; a ``.xacro`` file is expanded first, and line numbers are those of the
            expanded text.
        base: the link that is the satellite; the root if None.
        repair: repair defects where possible, and list them in ``findings``.
        tools: links whose frames are end effectors, the first one *the* tool; None: the frames at
            the ends of the branches, those with the most joints to the base first.
        text: read instead of the file; ``path`` is its name, for errors and meshes.

    Raises:
        InputError: the file is not a URDF, or has a defect; names link or joint, line, value and
            the possible repair.
    """
    path = Path(path)
    text = expand_urdf(path) if text is None else text
    report = Report(str(path))
    root = parse_xml(text, report.where)
    name = _robot_name(root, path, report)
    _check_counts(root, report)
    links = read_links(root, read_colours(root, report), path.absolute().parent, report)
    joints = read_joints(root, links, report)
    tree = build_tree(links, joints, base, report.where)
    mend_massless(links, tree)
    check_kinds(tree)
    mend_inertias(links, tree)
    _check_moving(tree, report)
    for tool in tools or ():
        one_of(tool, links, "link", f" for a tool of {report.where}")
    if (repeated := first_repeated(tools or ())) is not None:
        raise InputError(f"{report.where}: tools: link {short(repeated)} occurs twice")
    # all defects have been collected, the first one is told with the count of the others
    if not repair:
        report.refuse_defects()
    frames = end_frames(links, tree) if tools is None else tools
    whole = make_tree(name, links, tree, frames)
    return UrdfRobot(whole, tuple(report.sorted()), text, moved_frames(tree))


def _robot_name(root: Element, path: Path, report: Report) -> str:
    if root.tag != "robot":
        raise Fields(report, f"<{short_tag(root.tag)}>").error(root, "the root must be <robot>")
    elements = [root]
    for element in elements:
        elements += element.children
        if element.tag.startswith("xacro:"):
            advice = f"xacro must be expanded first: rename the file to end in {XACRO}"
            raise Fields(report, f"<{short_tag(element.tag)}>").error(element, advice)
    name = root.attributes.get("name", "").strip()
    if name and name.isprintable():
        return name
    repair = f"named {short(path.stem)}"
    Fields(report, "robot").repaired(root, "a printable name is required", name, repair)
    return path.stem


def _check_counts(root: Element, report: Report) -> None:
    # before they are read, which takes time; some joints may be locked later, so more are allowed
    links = len(list(root.all("link")))
    if links > MOST_LINKS:
        raise InputError(f"{report.where}: at most {MOST_LINKS} links can be read, got {links}")
    moving = sum(joint.attributes.get("type") != "fixed" for joint in root.all("joint"))
    if moving > MOST_MOVING:
        raise InputError(
            f"{report.where}: at most {MOST_JOINTS} moving joints can be flown, got {moving}"
        )


def _check_moving(tree: Tree, report: Report) -> None:
    moving = [edge.joint for edge in tree.edges.values() if edge.moves]
    if not moving:
        raise InputError(f"{report.where}: no moving joint: a robot needs at least one")
    names = [joint.name for joint in moving]
    for joint in moving:
        if meaning := other_meaning(joint.name, names):
            raise joint.fields.error(joint.line, f"it needs another name: this is {meaning}")


def expand_urdf(path: Path) -> str:
    """Return the text of a URDF, or of a xacro file with default arguments.

    Raises:
        InputError: it cannot be read; or xacro is not installed, or cannot expand the file.
    """
    if path.suffix != XACRO:
        return read_file(path)
    check_readable(path)
    try:
        import xacro
    except ImportError:
        raise InputError(
            f"{path}: xacro is not installed: `{install_command('xacro')}` or `apt install "
            "ros-jazzy-xacro`, or expand the file elsewhere to a .urdf"
        ) from None
    said = io.StringIO()  # warnings, and the position of an error
    try:
        with contextlib.redirect_stderr(said):
            document = xacro.process_file(str(path))
        return str(document.toprettyxml(indent="  "))
    except (Exception, SystemExit) as error:  # expressions in a file may raise anything
        words, more = (" ".join(text.split()) for text in (str(error), said.getvalue()))
        words += "" if more in words else f" {more}"
        raise InputError(f"{path}: xacro cannot expand it ({words[:300]})") from None


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
        key: new_names.get((NAMED_KINDS.get((element.tag, key), ""), value), value)
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
