"""Links and joints of a URDF as a tree, repaired, and as the parts of a robot."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Literal, cast

import numpy as np

from space_robot_msgs_py.config.validation import one_of, short

from ..elementary.matrices import Array, product, rotate_tensor
from .inertia import inertia_defect, nearest_inertia
from .parts import Base, Body, RobotTree, Tool, Visual, moved
from .urdf_joints import UrdfJoint
from .urdf_links import MASSLESS, UrdfLink
from .urdf_xml import IDENTITY, UrdfFrame

Kind = Literal["revolute", "prismatic", "fixed"]

MOUNT = "`space-robot new --on` mounts an arm on a satellite"

SOLID = 1000.0
"""Assumed density of a body of unknown shape, kg/m3."""


@dataclass
class Edge:
    """A joint with its direction in the tree."""

    joint: UrdfJoint
    parent: str
    """Name of the link nearer to the base."""
    is_reversed: bool
    """True if the file has the opposite direction: the joint's child carries its parent."""

    @property
    def moves(self) -> bool:
        """True if the joint is not fixed."""
        return self.joint.kind != "fixed"


@dataclass
class Tree:
    """All links, from the base outwards."""

    base: str
    order: list[str]
    """Names of the links, parents before children."""
    edges: dict[str, Edge]
    """Joint to the parent for each link except the base, by link name, in the file's order."""

    def carriers(self) -> dict[str, str]:
        """Return for each link the link (possibly itself) whose joint moves it, or the base."""
        carriers = {self.base: self.base}
        for name in self.order[1:]:
            edge = self.edges[name]
            carriers[name] = name if edge.moves else carriers[edge.parent]
        return carriers

    def leaves(self) -> set[str]:
        """Return the links without children."""
        return set(self.order) - {edge.parent for edge in self.edges.values()}


def build_tree(
    links: Mapping[str, UrdfLink], joints: Mapping[str, UrdfJoint], base: str | None, where: str
) -> Tree:
    """Build the tree of links with ``base``, or the URDF's root, as its root.

    If the base is not the URDF's root, the joints between them are reversed: child and parent are
    exchanged.

    Raises:
        InputError: the links do not form one tree, or there is no such base.
    """
    root = _root(links, joints)
    if base is not None:
        one_of(base, links, "link", f" for the base of {where}")
    neighbours: dict[str, list[tuple[str, Edge]]] = {name: [] for name in links}
    for joint in joints.values():
        neighbours[joint.parent].append((joint.child, Edge(joint, joint.parent, False)))
        neighbours[joint.child].append((joint.parent, Edge(joint, joint.child, True)))
    tree = Tree(base or root, [], {})
    waiting = [tree.base]
    while waiting:
        name = waiting.pop()
        tree.order.append(name)
        # the stack gives the last one first
        for other, edge in reversed(neighbours[name]):
            if name == tree.base or edge.joint is not tree.edges[name].joint:
                tree.edges[other] = edge
                waiting.append(other)
    place = {name: number for number, name in enumerate(joints)}
    tree.edges = dict(sorted(tree.edges.items(), key=lambda item: place[item[1].joint.name]))
    return tree


def _root(links: Mapping[str, UrdfLink], joints: Mapping[str, UrdfJoint]) -> str:
    """Return the link without parent, after checking that it is connected to all others."""
    above: dict[str, UrdfJoint] = {}
    for joint in joints.values():
        if joint.child in above:
            other = above[joint.child]
            raise joint.fields.error(
                joint.line,
                f"its child {short(joint.child)} is the child of "
                f"joint {short(other.name)} (line {other.line}) already: loops cannot be closed",
            )
        above[joint.child] = joint
    roots = [link for link in links.values() if link.name not in above]
    if len(roots) > 1:
        raise roots[1].fields.error(
            roots[1].line,
            f"only the root may have no parent, got {len(roots)} such links",
            ", ".join(link.name for link in roots),
        )
    seen = {link.name for link in roots}
    below: dict[str, list[str]] = {name: [] for name in links}
    for joint in joints.values():
        below[joint.parent].append(joint.child)
    waiting = list(seen)
    while waiting:
        children = below[waiting.pop()]
        seen.update(children)
        waiting += children
    for name in links:
        if name not in seen:
            joint = above[name]
            raise joint.fields.error(joint.line, "parents and children form a loop")
    return roots[0].name


def mend_massless(links: Mapping[str, UrdfLink], tree: Tree) -> None:
    """Lock the joints of massless bodies where possible: at tips and at the root.

    Raises:
        InputError: a massless body carries others, so its motion is undefined.
    """
    # locking a joint merges two bodies, which may be massless still
    while True:
        carriers = tree.carriers()
        mass = dict.fromkeys(carriers.values(), 0.0)
        for name, carrier in carriers.items():
            mass[carrier] += links[name].mass
        massless = [name for name in tree.order if mass.get(name, 1.0) < MASSLESS]
        if not massless:
            return
        carried: dict[str, list[str]] = {name: [] for name in mass}
        for name in mass:
            if name != tree.base:
                carried[carriers[tree.edges[name].parent]].append(name)
        tips = [name for name in massless if not carried[name] and name != tree.base]
        if tips:
            edge = tree.edges[tips[0]]
            _lock(links[tips[0]], "a moving link", edge, carriers[edge.parent])
        elif tree.base in massless and len(carried[tree.base]) == 1:
            child = carried[tree.base][0]
            _lock(links[tree.base], "the base", tree.edges[child], child, f" ({MOUNT})")
        else:
            link = links[massless[0]]
            what = "a base that" if link.name == tree.base else "a moving link that"
            raise link.fields.error(
                link.mass_line, f"{what} carries others must have a mass", f"{link.mass:g}"
            )


def _lock(defective: UrdfLink, what: str, edge: Edge, other: str, advice: str = "") -> None:
    """Lock a joint at 0 which moves nothing, or whose child floats freely anyway."""
    repair = f"{edge.joint.fields.part} locked at 0, merged into link {short(other)}"
    mass = f"{defective.mass:g}"
    defective.fields.repaired(defective.mass_line, f"{what} must have a mass{advice}", mass, repair)
    edge.joint = replace(edge.joint, kind="fixed")


def check_kinds(tree: Tree) -> None:
    """Check that no joint has more than one degree of freedom.

    Raises:
        InputError: a joint has more than one.
    """
    for edge in tree.edges.values():
        if edge.joint.kind in ("floating", "planar"):
            raise edge.joint.fields.error(
                edge.joint.line,
                "it has more than one degree of freedom: use revolute, "
                "continuous and prismatic joints, with links with mass between them",
                edge.joint.kind,
            )


def mend_inertias(links: Mapping[str, UrdfLink], tree: Tree) -> None:
    """Check the physical consistency of every link with mass, and repair inertias.

    Zero inertia is allowed for a link that is fixed to one with inertia.
    """
    carriers = tree.carriers()
    solid = set()
    for name, link in links.items():
        if link.mass >= MASSLESS and inertia_defect(link.mass, link.inertia)[0] == "":
            solid.add(carriers[name])
    for name, link in links.items():
        if link.mass < MASSLESS or (carriers[name] in solid and not link.inertia.any()):
            continue
        defect, moments = inertia_defect(link.mass, link.inertia)
        if not defect:
            continue
        # zero has nothing near it but a point
        nearest = nearest_inertia(link.inertia) if "zero" not in defect else None
        repair = "raised to the nearest physical one"
        if nearest is None or inertia_defect(link.mass, nearest)[0]:
            nearest, what = solid_inertia(link.mass, link.visuals)
            repair = f"that of {what}"
        shown = ", ".join(f"{moment:.4g}" for moment in np.linalg.eigvalsh(nearest))
        link.fields.repaired(
            link.mass_line, defect, moments, f"{repair}, principal moments {shown}"
        )
        link.inertia = nearest


def solid_inertia(mass: float, visuals: tuple[Visual, ...]) -> tuple[Array, str]:
    """Return the inertia, kg m2, of a homogeneous body with the first shape, and its description.

    Without a shape it is a sphere with the density of water.

    Args:
        mass: kg.
        visuals: shapes of the body; meshes are ignored.
    """
    for visual in visuals:
        if visual.shape != "mesh":
            turn = visual.rotation
            inertia: Array = rotate_tensor(turn, np.diag(_solid(mass, visual.shape, visual.size)))
            return inertia, f"the solid {visual.shape} of its visual"
    from ..elementary.functions import exp, log  # slow to import

    radius = exp(log(3.0 * mass / (4.0 * math.pi * SOLID)) / 3.0)
    ball = _solid(mass, "sphere", (radius,))
    return np.diag(ball), f"a solid sphere of {radius:.3g} m (density of water)"


def _solid(mass: float, shape: str, size: tuple[float, ...]) -> list[float]:
    if shape == "sphere":
        return [0.4 * mass * size[0] * size[0]] * 3
    if shape == "cylinder":
        radius, length = size
        across = mass * (3.0 * radius * radius + length * length) / 12.0
        return [across, across, 0.5 * mass * radius * radius]
    x, y, z = (mass * edge * edge / 12.0 for edge in size)
    return [y + z, x + z, x + y]


def make_tree(
    name: str, links: Mapping[str, UrdfLink], tree: Tree, tools: Sequence[str]
) -> RobotTree:
    """Return the robot, its links in the order of their joints.

    Args:
        name: of the robot.
        links: by name.
        tree: of links and joints.
        tools: links whose frames are tools, in order of rank.
    """
    frames, root = moved_frames(tree), links[tree.base]
    base = Base(root.mass, *_matter(root, IDENTITY), root.name)
    own = [_link(links[child], edge, frames) for child, edge in tree.edges.items()]
    visuals, ends = [], []
    for child in (tree.base, *tree.edges):
        frame = frames.get(child, IDENTITY)
        for visual in links[child].visuals:
            visuals.append(moved(visual, frame.rotation.T, frame.inside, link=child))
    for tool in tools:
        frame = frames.get(tool, IDENTITY)
        ends.append(Tool(tool, frame.rotation.T, frame.inside(np.zeros(3)), link=tool))
    return RobotTree(name, base, own, tools=ends, visuals=visuals)


def moved_frames(tree: Tree) -> dict[str, UrdfFrame]:
    """Return the frames of bodies relative to their links', where they differ.

    The axis of a reversed joint passes through the frame of its new parent, so its new child gets
    its frame there; all other bodies have the frames of their links.
    """
    return {edge.joint.parent: edge.joint.frame for edge in tree.edges.values() if edge.is_reversed}


def end_frames(links: Mapping[str, UrdfLink], tree: Tree) -> list[str]:
    """Return the links whose frames are tools, those with the most joints to the base first.

    They are fixed massless links without children, and the last moving link of a branch without
    such links.
    """
    carriers, leaves = tree.carriers(), tree.leaves()
    depth = {tree.base: 0}
    for name in tree.order[1:]:
        edge = tree.edges[name]
        depth[name] = depth[edge.parent] + edge.moves
    ends = [name for name in tree.edges if name in leaves and links[name].mass < MASSLESS]
    carried = {carriers[edge.parent] for edge in tree.edges.values() if edge.moves}
    for name, edge in tree.edges.items():
        if edge.moves and name not in carried and name not in {carriers[end] for end in ends}:
            ends.append(name)
    place = {name: number for number, name in enumerate(tree.edges)}
    return sorted(ends, key=lambda name: (-depth[name], place[name]))


def _link(link: UrdfLink, edge: Edge, frames: Mapping[str, UrdfFrame]) -> Body:
    joint, parent = edge.joint, frames.get(edge.parent, IDENTITY)
    rotation = parent.rotation.T
    # seen from the child: the joint turns the other way, about an axis through the parent's frame
    if edge.is_reversed:
        offset, axis = -parent.position, -joint.axis
    else:
        rotation = product(rotation, joint.frame.rotation)
        offset = product(joint.frame.rotation.T, joint.frame.position - parent.position)
        axis = joint.axis
    inertia, com = _matter(link, frames.get(link.name, IDENTITY))
    return Body(
        name=link.name,
        parent=edge.parent,
        joint=cast(Kind, joint.kind),
        joint_name=joint.name,
        rotation=rotation,
        offset=offset,
        axis=axis,
        mass=link.mass,
        inertia=inertia,
        com=com,
        limits=joint.limits,
        friction=joint.friction,
    )


def _matter(link: UrdfLink, frame: UrdfFrame) -> tuple[Array, Array]:
    return rotate_tensor(frame.rotation.T, link.inertia), frame.inside(link.com)
