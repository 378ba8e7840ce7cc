"""A robot from a URDF file."""

from __future__ import annotations

import contextlib
import io
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from space_robot_msgs_py.config.validation import one_of, short
from space_robot_msgs_py.config.yaml_text import check_file, read_file
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.topics import BASE_AXES

from ...dynamics.model import MOST_JOINTS
from ..tree import Body, JointFriction, Spring
from .bodies import check_kinds, end_frames, make_bodies, mend_inertias, mend_massless
from .elements import Element, parse_xml
from .findings import Finding, Report, short_tag
from .graph import Tree, build_tree
from .joints import read_joints
from .links import read_links
from .visuals import read_colours

XACRO = ".xacro"
MOST_LINKS = 4000
MOST_MOVING = 4 * MOST_JOINTS
"""Joints that are not fixed; some of them may be locked for want of mass."""


@dataclass(frozen=True)
class UrdfRobot:
    """What a URDF holds, for `space_robot_model.robot.Robot.of_tree`."""

    name: str
    bodies: list[Body]
    """One for each link, the base first, then in the order of their joints."""
    findings: tuple[Finding, ...]
    """What was repaired."""
    text: str
    """The URDF itself, expanded if it was xacro."""


def read_urdf(
    path: str | Path,
    base: str | None = None,
    repair: bool = False,
    tools: Sequence[str] | None = None,
) -> UrdfRobot:
    """Read a URDF file, or a xacro file where that package is installed.

    Args:
        path: the file; one that ends in ``.xacro`` is expanded first, and its lines are counted
            after that.
        base: the link that is the satellite; the root if None.
        repair: mend the defects that can be mended, and tell them in ``findings``.
        tools: links whose frames are the end effectors', the first one *the* tool; None: the
            frames at the ends of the branches, those behind the most joints first.

    Raises:
        InputError: the file is no URDF, or has a defect; in one line that names link or joint,
            line, value and what ``repair`` would do.
    """
    path = Path(path)
    text = expand_xacro(path) if path.suffix == XACRO else read_file(path)
    return parse_urdf(text, path, base, repair, tools)


def parse_urdf(
    text: str,
    path: Path,
    base: str | None = None,
    repair: bool = False,
    tools: Sequence[str] | None = None,
) -> UrdfRobot:
    """Read the text of a URDF as `read_urdf` does; ``path``: its name, and where meshes are."""
    report = Report(str(path))
    root = parse_xml(text, report.where)
    name = _robot_name(root, path, report)
    _check_counts(root, report)
    links = read_links(root, read_colours(root, report), path.absolute().parent, report)
    joints = read_joints(root, links, report)
    tree = build_tree(links, joints, base, report)
    mend_massless(links, tree, report)
    check_kinds(tree, report)
    mend_inertias(links, tree, report)
    _check_moving(tree, report)
    for tool in tools or ():
        one_of(tool, links, "link", f" for a tool of {report.where}")
    if not repair:
        report.refuse_defects()
    frames = end_frames(links, tree) if tools is None else tools
    bodies = make_bodies(links, tree, frames)
    return UrdfRobot(name, bodies, tuple(report.sorted()), text)


def with_springs(urdf: UrdfRobot, springs: Mapping[str, Spring], where: str) -> UrdfRobot:
    """Return the robot with some of its joints held by springs in the place of motors.

    URDF knows no springs. Their damping takes the place of that in ``<dynamics>``.

    Raises:
        InputError: one of the names is no joint that moves.
    """
    moving = [body.joint.name for body in urdf.bodies if body.joint and body.joint.kind != "fixed"]
    for name in springs:
        one_of(name, moving, "passive joint", f" of {where}")
    bodies = []
    for body in urdf.bodies:
        if body.joint and body.joint.name in springs:
            coulomb = body.joint.friction.coulomb
            joint = replace(
                body.joint,
                spring=springs[body.joint.name],
                friction=JointFriction(coulomb, math.nan if math.isnan(coulomb) else 0.0),
            )
            body = replace(body, joint=joint)
        bodies.append(body)
    return replace(urdf, bodies=bodies)


def _robot_name(root: Element, path: Path, report: Report) -> str:
    """Return the robot's name, having seen that the file describes one."""
    if root.tag != "robot":
        raise report.error(root.line, f"<{short_tag(root.tag)}>", "the root must be <robot>")
    for element in _all_elements(root):
        if element.tag.startswith("xacro:"):
            raise report.error(
                element.line,
                f"<{short_tag(element.tag)}>",
                f"xacro must be expanded first: give the file a name that ends in {XACRO}",
            )
    name = root.attributes.get("name", "").strip()
    if name and name.isprintable():
        return name
    report.repaired(
        root.line, "robot", "it needs a printable name", name, f"named {short(path.stem)}"
    )
    return path.stem


def _check_counts(root: Element, report: Report) -> None:
    """Refuse a file that is far too large before it is read link by link.

    Joints may turn out to be locked, so that more of them than can be flown are read.
    """
    links = len(list(root.all("link")))
    if links > MOST_LINKS:
        raise InputError(
            f"{report.where}: at most {MOST_LINKS} links can be read, here are {links}"
        )
    moving = sum(joint.attributes.get("type") != "fixed" for joint in root.all("joint"))
    if moving > MOST_MOVING:
        raise InputError(
            f"{report.where}: at most {MOST_JOINTS} moving joints can be flown, here are {moving}"
        )


def _all_elements(root: Element) -> list[Element]:
    elements = [root]
    for element in elements:
        elements += element.children
    return elements


def _check_moving(tree: Tree, report: Report) -> None:
    """Check that joints move, under names that are free."""
    moving = [edge.joint for edge in tree.edges.values() if edge.moves]
    if not moving:
        raise InputError(f"{report.where}: no joint moves: a robot needs one at least")
    for joint in moving:
        if joint.name in BASE_AXES:
            raise report.error(joint.line, joint.part, "that is the name of a base axis")


def expand_xacro(path: Path) -> str:
    """Return the URDF text that a xacro file stands for, every argument at its default.

    Raises:
        InputError: the package is not installed, or does not like the file.
    """
    check_file(path)
    try:
        import xacro
    except ImportError:
        raise InputError(
            f"{path}: xacro is not installed: `pip install 'space_robot[xacro]'` or `apt install "
            "ros-jazzy-xacro`, or expand the file elsewhere to a .urdf"
        ) from None
    said = io.StringIO()  # warnings, and where it was when it failed
    try:
        with contextlib.redirect_stderr(said):
            document = xacro.process_file(str(path))
        return str(document.toprettyxml(indent="  "))
    except (Exception, SystemExit) as error:  # whatever the expressions in a file come to
        words, more = (" ".join(text.split()) for text in (str(error), said.getvalue()))
        words += "" if more in words else f" {more}"
        raise InputError(f"{path}: xacro cannot expand it ({words[:300]})") from None
