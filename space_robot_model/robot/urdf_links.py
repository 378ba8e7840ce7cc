"""Links of a URDF: masses, inertias, shapes."""

from __future__ import annotations

import os.path
import re
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

import numpy as np

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import Array, rotate_tensor
from .inertia import inertia_tensor
from .parts import Colour, Visual
from .urdf_xml import Element, Fields, Report, UrdfFrame, short_tag

ELEMENTS = ("inertial", "visual", "collision")
EXTENSIONS = ("contact", "gravity", "self_collision_checking", "sensor", "verbose")
MASSLESS = 1e-9
"""Mass below which a body counts as massless, kg."""
MOMENTS = ("ixx", "iyy", "izz", "ixy", "ixz", "iyz")


@dataclass
class UrdfLink:
    """A link as in the file; vectors are in its axes."""

    fields: Fields
    """Report of its defects."""
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


def read_links(
    robot: Element, colours: Colours, folder: Path, report: Report
) -> dict[str, UrdfLink]:
    """Return all links by name, in the order of the file."""
    links: dict[str, UrdfLink] = {}
    for element in robot.all("link"):
        name = read_name(element, report)
        fields = Fields(report, f"link {short(name)}")
        if name in links:
            taken = f"the name is taken by the link in line {links[name].line}"
            raise fields.error(element, taken)
        links[name] = _link(element, name, colours, folder, fields)
    if not links:
        raise Fields(report, "robot").error(robot, "there is no <link>")
    return links


def read_name(element: Element, report: Report) -> str:
    """Return the name of a link or joint, which must be printable."""
    name = element.attributes.get("name", "")
    if not name.strip() or not name.isprintable():
        raise Fields(report, element.tag).error(element, "a printable name is needed", name)
    return name


def _link(element: Element, name: str, colours: Colours, folder: Path, fields: Fields) -> UrdfLink:
    link = UrdfLink(
        fields,
        name,
        element.line,
        element.line,
        0.0,
        np.zeros((3, 3)),
        np.zeros(3),
        _read_visuals(element, fields, colours, folder),
    )
    fields.check_content(element, ELEMENTS + EXTENSIONS, ("name", "type"))
    inertial = fields.only(element, "inertial")
    if inertial is not None:
        _read_inertial(inertial, link)
    return link


def _read_inertial(inertial: Element, link: UrdfLink) -> None:
    fields = link.fields
    fields.check_content(inertial, ("origin", "mass", "inertia"), ())
    frame = fields.frame(fields.only(inertial, "origin"))
    link.com, link.mass_line = frame.position, inertial.line
    mass = fields.only(inertial, "mass")
    if mass is not None:
        fields.check_content(mass, (), ("value",))
        link.mass, link.mass_line = fields.number(mass, "value"), mass.line
    if link.mass < 0.0:
        raise fields.error(link.mass_line, "mass must be at least 0 kg", f"{link.mass:g}")
    inertia = fields.only(inertial, "inertia")
    if inertia is None:
        return
    fields.check_content(inertia, (), MOMENTS)
    # urdfdom refuses files with a missing element; a missing product probably means 0
    for product in MOMENTS[3:]:
        if product not in inertia.attributes:
            fields.repaired(inertia, f"<inertia> needs {product!r}", "", "read as 0")
    values = [fields.number(inertia, moment) for moment in MOMENTS[:3]]
    values += [fields.number(inertia, product, 0.0) for product in MOMENTS[3:]]
    link.inertia = rotate_tensor(frame.rotation, inertia_tensor(values))
    if link.mass < MASSLESS and link.inertia.any():
        trace = f"{np.trace(link.inertia):g} kg m2 (trace)"
        fields.repaired(inertia, "inertia without mass", trace, "the inertia is ignored")
        link.inertia = np.zeros((3, 3))


Colours = dict[str, Colour]


def read_colours(robot: Element, report: Report) -> Colours:
    """Return the colours of all named materials in the file."""
    in_visuals = [
        material
        for link in robot.all("link")
        for visual in link.all("visual")
        for material in visual.all("material")
    ]
    colours: Colours = {}
    for material in [*in_visuals, *robot.all("material")]:
        name = material.attributes.get("name", "")
        fields = Fields(report, f"material {short(name)}")
        try:
            colour = _colour(material, {}, fields)
        except InputError as error:
            _leave_out(material, fields, error, "the colour")
        else:
            if name and colour:
                colours[name] = colour
    return colours


def _read_visuals(
    link: Element, fields: Fields, colours: Colours, folder: Path
) -> tuple[Visual, ...]:
    """Return the shapes of a link; an invalid one is a defect and is omitted."""
    visuals = []
    for element in link.all("visual"):
        own = Fields(Report(fields.report.where), fields.part)
        try:
            visuals.append(_visual(element, own, colours, folder))
        except InputError as error:
            _leave_out(element, fields, error, "the shape")
        fields.report.findings += own.report.findings
    return tuple(visuals)


def _visual(element: Element, fields: Fields, colours: Colours, folder: Path) -> Visual:
    fields.check_content(element, ("origin", "geometry", "material", "meta"), ("name",))
    frame = fields.frame(fields.only(element, "origin"))
    geometry = fields.only(element, "geometry")
    if geometry is None or len(geometry.children) != 1:
        raise fields.error(element, "<visual> needs one <geometry> of one shape")
    colour = None
    for material in element.all("material"):
        colour = _colour(material, colours, fields)
    return _shape(geometry.children[0], frame, colour, fields, folder)


def _shape(
    shape: Element, frame: UrdfFrame, colour: Colour | None, fields: Fields, folder: Path
) -> Visual:
    if shape.tag == "mesh":
        scale = tuple(map(float, fields.vector(shape, "scale", (1.0, 1.0, 1.0))))
        name = shape.attributes.get("filename", "")
        if not name or not name.isprintable():
            raise fields.error(shape, "a mesh needs a filename", name)
        mesh = mesh_path(name, folder)
        return Visual("mesh", scale, frame.rotation, frame.position, mesh, colour)
    if shape.tag == "box":
        size = tuple(map(float, fields.vector(shape, "size", None)))
    elif shape.tag == "cylinder":
        size = (fields.number(shape, "radius"), fields.number(shape, "length"))
    elif shape.tag == "sphere":
        size = (fields.number(shape, "radius"),)
    else:
        kinds = "a shape must be box, cylinder, sphere or mesh"
        raise fields.error(shape, kinds, short_tag(shape.tag))
    if min(size) <= 0.0:
        sizes = " ".join(f"{edge:g}" for edge in size)
        raise fields.error(shape, f"<{shape.tag}> must have sizes above 0", sizes)
    return Visual(shape.tag, size, frame.rotation, frame.position, "", colour)  # type: ignore[arg-type]


def _colour(material: Element, colours: Colours, fields: Fields) -> Colour | None:
    """Return a material's own colour, else that of its name; None if unknown."""
    for element in material.all("color"):
        red, green, blue, alpha = fields.vector(element, "rgba", None, count=4)
        return float(red), float(green), float(blue), float(alpha)
    return colours.get(material.attributes.get("name", ""))


def _leave_out(element: Element, fields: Fields, error: InputError, what: str) -> None:
    words = str(error).split(f"{fields.part}: ", 1)[-1]
    fields.repaired(element, f"<{element.tag}>: {words}", "", f"{what} is ignored")


PACKAGE, FILE = ("package://", "model://"), "file://"


def mesh_path(name: str, folder: Path) -> str:
    """Return the path of a mesh file, or its unchanged name if the file does not exist.

    Args:
        name: a path relative to the URDF's folder, ``file://``, or ``package://NAME/...``: in an
            installed ROS package, in a parent folder NAME of the URDF, or in a folder beside its
            parents.
        folder: of the URDF.
    """
    if name.startswith(FILE):
        return unquote(name.removeprefix(FILE))
    for scheme in PACKAGE:
        if name.startswith(scheme):
            package, _, rest = name.removeprefix(scheme).partition("/")
            return next((str(p) for p in _places(package, rest, folder) if os.path.isfile(p)), name)
    return name if "://" in name else str(folder / name)


def with_absolute_meshes(text: str, folder: Path) -> str:
    """Return a URDF's text with absolute paths of its meshes, so that it may be in any folder.

    Args:
        text: of the URDF; names of files that do not exist are kept.
        folder: that the names are relative to.
    """

    def absolute(match: re.Match[str]) -> str:
        path = mesh_path(unescape(match[2][1:-1]), folder)
        return f"{match[1]}{quoteattr(path)}" if os.path.isfile(path) else match[0]

    return re.sub(r"""(<mesh\b[^>]*?\bfilename\s*=\s*)("[^"]*"|'[^']*')""", absolute, text)


def _places(package: str, rest: str, folder: Path) -> Iterator[Path]:
    """Yield possible paths of a package's file, the most likely first."""
    for above in (folder, *folder.parents):
        if above.name == package:
            yield above / rest
        yield above / package / rest
    for prefix in _paths("AMENT_PREFIX_PATH"):
        yield prefix / "share" / package / rest
    for source in _paths("ROS_PACKAGE_PATH"):
        yield source / package / rest


def _paths(variable: str) -> list[Path]:
    return [Path(text) for text in os.environ.get(variable, "").split(os.pathsep) if text]
