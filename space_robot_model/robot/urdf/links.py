"""Links of a URDF: masses, inertias, shapes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.config.validation import short

from ...elementary.matrices import rotate_tensor
from ..parts import Visual
from .elements import Element
from .fields import Fields
from .findings import Report
from .visuals import Colours, read_visuals

Array = NDArray[np.float64]

ELEMENTS = ("inertial", "visual", "collision")
EXTENSIONS = ("contact", "gravity", "self_collision_checking", "sensor", "verbose")
NOTHING = 1e-9
"""Mass below which a body counts as massless, kg."""
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass
class UrdfLink:
    """A link as in the file; vectors are in its axes."""

    name: str
    line: int
    mass_line: int
    """Line of its mass, or of the link if it has none."""
    mass: float
    """Mass, kg; 0 if there is none."""
    inertia: Array
    """(3, 3) inertia about the CoM, kg m2."""
    com: Array
    """(3,) centre of mass, m."""
    visuals: tuple[Visual, ...]

    @property
    def part(self) -> str:
        """Name of the link in errors."""
        return f"link {short(self.name)}"


def read_links(
    robot: Element, colours: Colours, folder: Path, report: Report
) -> dict[str, UrdfLink]:
    """Return all links by name, in the order of the file."""
    links: dict[str, UrdfLink] = {}
    for element in robot.all("link"):
        name = read_name(element, report)
        if name in links:
            raise report.error(
                element.line,
                f"link {short(name)}",
                f"the name is taken by the link in line {links[name].line}",
            )
        links[name] = _link(element, name, colours, folder, report)
    if not links:
        raise report.error(robot.line, "robot", "there is no <link>")
    return links


def read_name(element: Element, report: Report) -> str:
    """Return the name of a link or joint, which must be printable."""
    name = element.attributes.get("name", "")
    if not name.strip() or not name.isprintable():
        raise report.error(element.line, element.tag, "a printable name is needed", name)
    return name


def _link(element: Element, name: str, colours: Colours, folder: Path, report: Report) -> UrdfLink:
    link = UrdfLink(
        name,
        element.line,
        element.line,
        0.0,
        np.zeros((3, 3)),
        np.zeros(3),
        read_visuals(element, f"link {short(name)}", colours, folder, report),
    )
    report.check_content(element, link.part, ELEMENTS + EXTENSIONS, ("name", "type"))
    inertial = report.only(element, "inertial", link.part)
    if inertial is not None:
        _read_inertial(inertial, link, Fields(report, link.part))
    return link


def _read_inertial(inertial: Element, link: UrdfLink, fields: Fields) -> None:
    report, part = fields.report, link.part
    report.check_content(inertial, part, ("origin", "mass", "inertia"), ())
    frame = fields.frame(report.only(inertial, "origin", part))
    link.com, link.mass_line = frame.position, inertial.line
    mass = report.only(inertial, "mass", part)
    if mass is not None:
        report.check_content(mass, part, (), ("value",))
        link.mass, link.mass_line = fields.number(mass, "value"), mass.line
    if link.mass < 0.0:
        raise report.error(link.mass_line, part, "mass must be at least 0 kg", f"{link.mass:g}")
    inertia = report.only(inertial, "inertia", part)
    if inertia is None:
        return
    report.check_content(inertia, part, (), MOMENTS)
    # urdfdom refuses files with a missing element; a missing product probably means 0
    for product in MOMENTS[3:]:
        if product not in inertia.attributes:
            report.repaired(inertia.line, part, f"<inertia> needs {product!r}", "", "read as 0")
    values = [fields.number(inertia, moment) for moment in MOMENTS[:3]]
    values += [fields.number(inertia, product, 0.0) for product in MOMENTS[3:]]
    xx, yy, zz, xy, xz, yz = values
    tensor = np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])
    link.inertia = rotate_tensor(frame.rotation, tensor)
    if link.mass < NOTHING and link.inertia.any():
        report.repaired(
            inertia.line,
            part,
            "inertia without mass",
            f"{np.trace(link.inertia):g} kg m2 (trace)",
            "the inertia is ignored",
        )
        link.inertia = np.zeros((3, 3))
