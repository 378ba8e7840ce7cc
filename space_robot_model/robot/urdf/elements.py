"""XML as a tree of elements with line numbers; dangerous content is refused."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, field
from xml.parsers import expat

from space_robot_msgs_py.errors import InputError

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
