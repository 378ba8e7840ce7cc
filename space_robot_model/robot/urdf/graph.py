"""Links and joints as a tree with the base as root."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

from space_robot_msgs_py.config.validation import one_of, short

from .findings import Report
from .joints import UrdfJoint
from .links import UrdfLink


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
    links: Mapping[str, UrdfLink], joints: Mapping[str, UrdfJoint], base: str | None, report: Report
) -> Tree:
    """Build the tree of links with ``base``, or the URDF's root, as its root.

    If the base is not the URDF's root, the joints between them are reversed: child and parent are
    exchanged.

    Raises:
        InputError: the links do not form one tree, or there is no such base.
    """
    root = _root(links, joints, report)
    if base is not None:
        one_of(base, links, "link", f" for the base of {report.where}")
    neighbours: dict[str, list[tuple[str, Edge]]] = {name: [] for name in links}
    for joint in joints.values():
        neighbours[joint.parent].append((joint.child, Edge(joint, joint.parent, False)))
        neighbours[joint.child].append((joint.parent, Edge(joint, joint.child, True)))
    tree = Tree(base or root, [], {})
    waiting = [tree.base]
    while waiting:
        name = waiting.pop()
        tree.order.append(name)
        for other, edge in reversed(neighbours[name]):
            if name == tree.base or edge.joint is not tree.edges[name].joint:
                tree.edges[other] = edge
                waiting.append(other)
    place = {name: number for number, name in enumerate(joints)}
    tree.edges = dict(sorted(tree.edges.items(), key=lambda item: place[item[1].joint.name]))
    return tree


def _root(links: Mapping[str, UrdfLink], joints: Mapping[str, UrdfJoint], report: Report) -> str:
    """Return the link without parent, after checking that it is connected to all others."""
    above: dict[str, UrdfJoint] = {}
    for joint in joints.values():
        if joint.child in above:
            other = above[joint.child]
            raise report.error(
                joint.line,
                joint.part,
                f"its child {short(joint.child)} is the child of "
                f"joint {short(other.name)} (line {other.line}) already: loops cannot be closed",
            )
        above[joint.child] = joint
    roots = [link for link in links.values() if link.name not in above]
    if len(roots) > 1:
        raise report.error(
            roots[1].line,
            roots[1].part,
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
            raise report.error(joint.line, joint.part, "parents and children form a loop")
    return roots[0].name
