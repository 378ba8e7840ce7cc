"""XML as a tree of elements that know their line; what could harm a reader is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from space_robot_msgs_py.errors import InputError

DEEPEST = 100
"""Elements within one another."""


@dataclass
class Element:
    """An XML element; text between elements means nothing in URDF and is not kept."""

    tag: str
    line: int
    attributes: dict[str, str]
    children: list[Element] = field(default_factory=list)

    def all(self, tag: str) -> Iterator[Element]:
        """Yield the children that have a tag."""
        return (child for child in self.children if child.tag == tag)


def parse_xml(text: str, where: str) -> Element:
    """Return the root element of an XML text.

    Entities are not expanded but refused with the document type that would declare them: a few of
    them within one another can fill any memory.

    Raises:
        InputError: the text is empty, not XML, has a document type, or is nested too deep; in one
            line that names ``where`` and the line.
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
    except ValueError as error:  # characters that no file could hold
        raise InputError(f"{where}: not XML ({error})") from None
    return builder.top.children[0]


class _Builder:
    """Puts together what the parser reports."""

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
