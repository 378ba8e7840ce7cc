"""Visuals of URDF links."""

from __future__ import annotations

import os
import re
from collections.abc import Iterator
from pathlib import Path
from urllib.parse import unquote
from xml.sax.saxutils import quoteattr, unescape

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..parts import Visual
from .elements import Element
from .fields import Fields, UrdfFrame
from .findings import Report, short_tag

Colour = tuple[float, float, float, float]
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
        try:
            colour = _colour(material, {}, Fields(report, f"material {short(name)}"))
        except InputError as error:
            _left_out(material, f"material {short(name)}", error, "the colour", report)
        else:
            if name and colour:
                colours[name] = colour
    return colours


def read_visuals(
    link: Element, part: str, colours: Colours, folder: Path, report: Report
) -> tuple[Visual, ...]:
    """Return the shapes of a link; an invalid one is a defect and is omitted."""
    visuals = []
    for element in link.all("visual"):
        fields = Fields(Report(report.where), part)
        try:
            visuals.append(_visual(element, fields, colours, folder))
        except InputError as error:
            _left_out(element, part, error, "the shape", report)
        report.findings += fields.report.findings
    return tuple(visuals)


def _visual(element: Element, fields: Fields, colours: Colours, folder: Path) -> Visual:
    report, part = fields.report, fields.part
    report.check_content(element, part, ("origin", "geometry", "material", "meta"), ("name",))
    frame = fields.frame(report.only(element, "origin", part))
    geometry = report.only(element, "geometry", part)
    if geometry is None or len(geometry.children) != 1:
        raise report.error(element.line, part, "<visual> needs one <geometry> of one shape")
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
            raise fields.report.error(shape.line, fields.part, "a mesh needs a filename", name)
        mesh = mesh_path(name, folder)
        return Visual("mesh", scale, frame.rotation, frame.position, mesh, colour)
    if shape.tag == "box":
        size = tuple(map(float, fields.vector(shape, "size", None)))
    elif shape.tag == "cylinder":
        size = (fields.number(shape, "radius"), fields.number(shape, "length"))
    elif shape.tag == "sphere":
        size = (fields.number(shape, "radius"),)
    else:
        raise fields.report.error(
            shape.line,
            fields.part,
            "a shape must be box, cylinder, sphere or mesh",
            short_tag(shape.tag),
        )
    if min(size) <= 0.0:
        raise fields.report.error(
            shape.line,
            fields.part,
            f"<{shape.tag}> must have sizes above 0",
            " ".join(f"{edge:g}" for edge in size),
        )
    return Visual(shape.tag, size, frame.rotation, frame.position, "", colour)  # type: ignore[arg-type]


def _colour(material: Element, colours: Colours, fields: Fields) -> Colour | None:
    """Return a material's own colour, else that of its name; None if unknown."""
    for element in material.all("color"):
        red, green, blue, alpha = fields.vector(element, "rgba", None, count=4)
        return float(red), float(green), float(blue), float(alpha)
    return colours.get(material.attributes.get("name", ""))


def _left_out(element: Element, part: str, error: InputError, what: str, report: Report) -> None:
    words = str(error).split(f"{part}: ", 1)[-1]
    report.repaired(element.line, part, f"<{element.tag}>: {words}", "", f"{what} is ignored")


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
            return next((str(p) for p in _places(package, rest, folder) if _is_file(p)), name)
    return name if "://" in name else str(folder / name)


def with_absolute_meshes(text: str, folder: Path) -> str:
    """Return a URDF's text with absolute paths of its meshes, so that it may be in any folder.

    Args:
        text: of the URDF; names of files that do not exist are kept.
        folder: that the names are relative to.
    """

    def absolute(match: re.Match[str]) -> str:
        path = mesh_path(unescape(match[2][1:-1]), folder)
        return f"{match[1]}{quoteattr(path)}" if _is_file(path) else match[0]

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


def _is_file(path: str | Path) -> bool:
    try:
        return Path(path).is_file()
    except (OSError, ValueError):  # invalid file name
        return False
