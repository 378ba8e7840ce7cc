"""XML with line numbers, defects with their repairs, and strict reading of attributes."""

from __future__ import annotations

import math
import re
from collections.abc import Collection, Iterator
from dataclasses import dataclass, field
from typing import NamedTuple
from xml.parsers import expat

import numpy as np

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from ..elementary.matrices import Array, product
from ..elementary.rotations import rotation_of_rpy

DEEPEST = 100
"""Maximum depth of nested elements."""


@dataclass
class Element:
    """An XML element; text between elements has no meaning in URDF and is ignored."""

    tag: str
    line: int
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Yield the children with a tag."""
        return (child for child in self.children if child.tag == tag)


def parse_xml(text: str, where: str) -> Element:
    """Return the root element of an XML text.

    Document types are refused, because nested entities declared in them can fill the memory.

    Raises:
        InputError: the text is empty, not XML, has a document type, or is nested too deep; names
            ``where`` and the line.
    """
    if not text.strip():
        raise InputError(f"{where}: the file is empty, a URDF <robot> was expected")
    builder = _Builder(where)
    try:
        builder.parser.Parse(text, True)
    except expat.ExpatError as error:
        said = expat.ErrorString(error.code)
        raise InputError(f"{where}: line {error.lineno}: not XML ({said})") from None
    except InputError:
        raise
    except ValueError as error:  # invalid characters
        raise InputError(f"{where}: not XML ({error})") from None
    return builder.top.children[0]


class _Builder:
    """Builds the tree from the events of the parser."""

    def __init__(self, where: str) -> None:
        self.top = Element("", 0, {})
        self._where = where
        self._open = [self.top]
        self.parser = expat.ParserCreate()
        self.parser.StartElementHandler = self._start
        self.parser.EndElementHandler = self._end
        self.parser.StartDoctypeDeclHandler = self._refuse_doctype

    def _start(self, tag: str, attributes: dict[str, str]) -> None:
        if len(self._open) > DEEPEST:
            raise self._error(f"nested deeper than {DEEPEST} elements")
        element = Element(tag, self.parser.CurrentLineNumber, attributes)
        self._open[-1].children.append(element)
        self._open.append(element)

    def _end(self, _: str) -> None:
        self._open.pop()

    def _refuse_doctype(self, *_: object) -> None:
        raise self._error("a <!DOCTYPE> is not allowed in a URDF")

    def _error(self, text: str) -> InputError:
        return InputError(f"{self._where}: line {self.parser.CurrentLineNumber}: {text}")


@dataclass(frozen=True)
class Finding:
    """A defect that can be repaired."""

    part: str
    """The link or joint that has it, such as ``link 'tip'``."""
    line: int
    """Line in the file."""
    defect: str
    """Description of the defect, with the allowed values."""
    value: str
    """Value in the file."""
    repair: str
    """The repair, as a participle: ``merged into link 'arm'``."""

    def __str__(self) -> str:
        """Return defect and repair in one line."""
        return f"line {self.line}: {self._named()}: {self.repair}"

    def _named(self) -> str:
        return f"{self.part}: {self.defect}{f', got {self.value}' if self.value else ''}"


class Report:
    """Collects the defects of one file; an irreparable one is raised at once."""

    def __init__(self, where: str) -> None:
        """Store the name of the file, for errors."""
        self.where = where
        self.findings: list[Finding] = []

    def sorted(self) -> list[Finding]:
        """Return the stored defects, by line."""
        return sorted(self.findings, key=lambda finding: finding.line)

    def refuse_defects(self) -> None:
        """Raise an InputError for the first defect in the file, if any."""
        if not self.findings:
            return
        first = self.sorted()[0]
        more = f" (and {len(self.findings) - 1} more)" if len(self.findings) > 1 else ""
        raise InputError(
            f"{self.where}: line {first.line}: {first._named()} "
            f"(with --repair: {first.repair}){more}"
        )


def short_tag(tag: str) -> str:
    """Return the name of an element for errors, as one short line."""
    return short(tag)[1:-1]


LARGEST = 1e12
"""Largest allowed number in a file, kg, m, rad, ..., so that results stay finite.

A limit of this size means none: other readers of URDF do not accept ``inf``."""
_NUMBER = re.compile(r"[-+]?(?:[0-9]+\.?[0-9]*|\.[0-9]+)(?:[eE][-+]?[0-9]+)?")
_INFINITE = re.compile(r"([-+]?)inf(?:inity)?", re.IGNORECASE)


class UrdfFrame(NamedTuple):
    """A frame relative to another."""

    rotation: Array
    """(3, 3) its axes, as columns, in the axes of the other."""
    position: Array
    """(3,) position, m, in the axes of the other."""

    def inside(self, point: Array) -> Array:
        """Return a point (3,) of the other frame in this one, m."""
        return product(self.rotation.T, point - self.position)


IDENTITY = UrdfFrame(np.eye(3), np.zeros(3))


class Fields:
    """Reads the elements of one link or joint, and reports their defects."""

    def __init__(self, report: Report, part: str) -> None:
        """Store the report for defects, and the name of the link or joint."""
        self.report, self.part = report, part

    def error(self, at: Element | int, defect: str, value: str | None = None) -> InputError:
        """Return the error for an irreparable defect of an element or line, to be raised."""
        got = "" if value is None else f", got {short(value)}"
        line = at if isinstance(at, int) else at.line
        error = InputError(f"{self.report.where}: line {line}: {self.part}: {defect}{got}")
        error.help_topic = "own-robot"
        return error

    def repaired(self, at: Element | int, defect: str, value: str, repair: str) -> None:
        """Store a defect with its repair."""
        line = at if isinstance(at, int) else at.line
        value = value and short(value)
        self.report.findings.append(Finding(self.part, line, defect, value, repair))

    def check_content(
        self, element: Element, children: Collection[str], attributes: Collection[str]
    ) -> None:
        """Report unknown children and attributes, which are often misspelt, as defects.

        Names with a prefix, such as ``drake:``, are extensions and are ignored.
        """
        tag = short_tag(element.tag)
        for name, value in element.attributes.items():
            if name not in attributes and ":" not in name and name != "xmlns":
                known = f"(known: {', '.join(attributes) or 'none'})"
                unknown = f"<{tag}> has an unknown attribute {short(name)} {known}"
                self.repaired(element, unknown, value, "left out")
        for child in element.children:
            if child.tag not in children and ":" not in child.tag:
                known = f"(known: {', '.join(children) or 'none'})"
                unknown = f"<{tag}> has an unknown element <{short_tag(child.tag)}> {known}"
                self.repaired(child, unknown, "", "left out")

    def only(self, element: Element, tag: str) -> Element | None:
        """Return the child with a tag, or None; a second one is a defect."""
        elements = list(element.all(tag))
        for again in elements[1:]:
            lines = f"line {elements[0].line} and here"
            self.repaired(again, f"<{tag}> occurs twice", lines, "the first one is used")
        return elements[0] if elements else None

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """Return a number; without default the attribute is required."""
        text = element.attributes.get(name)
        if text is None and default is not None:
            return default
        if text is None:
            raise self.error(element, f"<{element.tag}> needs the attribute {name!r}")
        return self._number(element, name, text)

    def limit(self, element: Element, name: str) -> float | None:
        """Return a number, infinite for `LARGEST`; None if the attribute is missing."""
        text = element.attributes.get(name)
        if text is None:
            return None
        infinite = _INFINITE.fullmatch(text.strip())
        if infinite:
            return -math.inf if infinite[1] == "-" else math.inf
        value = self._number(element, name, text)
        return math.copysign(math.inf, value) if abs(value) == LARGEST else value

    def vector(
        self, element: Element, name: str, default: tuple[float, ...] | None, count: int = 3
    ) -> Array:
        """Return ``count`` numbers, separated by spaces."""
        text = element.attributes.get(name)
        if text is None and default is not None:
            return np.array(default)
        words = (text or "").split()
        if len(words) != count:
            raise self.error(element, f"{element.tag}.{name} must be {count} numbers", text or "")
        return np.array([self._number(element, name, word) for word in words])

    def frame(self, origin: Element | None) -> UrdfFrame:
        """Return the frame of an ``<origin>``, relative to that of its element."""
        if origin is None:
            return IDENTITY
        self.check_content(origin, (), ("xyz", "rpy"))
        zero = (0.0, 0.0, 0.0)
        rotation = rotation_of_rpy(self.vector(origin, "rpy", zero))
        return UrdfFrame(rotation, self.vector(origin, "xyz", zero))

    def _number(self, element: Element, name: str, text: str) -> float:
        value = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
        if abs(value) <= LARGEST:
            return value
        why = "is not a number" if math.isnan(value) else f"must be at most {LARGEST:g}"
        raise self.error(element, f"{element.tag}.{name} {why}", text)
