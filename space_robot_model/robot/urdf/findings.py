"""Defects of a robot's file, with part, line and value, and their repairs."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import asdict, dataclass
from typing import Any

from space_robot_msgs_py.config.validation import short
from space_robot_msgs_py.errors import InputError

from .elements import Element


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

    @property
    def told(self) -> dict[str, Any]:
        """Return the finding as a mapping."""
        return asdict(self)

    def _named(self) -> str:
        return f"{self.part}: {self.defect}{f', got {self.value}' if self.value else ''}"


class Report:
    """Collects the defects of one file; an irreparable one is raised at once."""

    def __init__(self, where: str) -> None:
        """Store the name of the file, for errors."""
        self.where = where
        self.findings: list[Finding] = []

    def error(self, line: int, part: str, defect: str, value: str | None = None) -> InputError:
        """Return the error for an irreparable defect, to be raised."""
        got = "" if value is None else f", got {short(value)}"
        error = InputError(f"{self.where}: line {line}: {part}: {defect}{got}")
        error.help_topic = "own-robot"
        return error

    def repaired(self, line: int, part: str, defect: str, value: str, repair: str) -> None:
        """Store a defect with its repair."""
        self.findings.append(Finding(part, line, defect, value and short(value), repair))

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

    def check_content(
        self, element: Element, part: str, children: Collection[str], attributes: Collection[str]
    ) -> None:
        """Report unknown children and attributes, which are often misspelt, as defects.

        Names with a prefix, such as ``drake:``, are extensions and are ignored.
        """
        for name, value in element.attributes.items():
            if name not in attributes and ":" not in name and name != "xmlns":
                self.repaired(
                    element.line,
                    part,
                    f"<{short_tag(element.tag)}> has an unknown attribute "
                    f"{short(name)} (known: {', '.join(attributes) or 'none'})",
                    value,
                    "left out",
                )
        for child in element.children:
            if child.tag not in children and ":" not in child.tag:
                self.repaired(
                    child.line,
                    part,
                    f"<{short_tag(element.tag)}> has an unknown element "
                    f"<{short_tag(child.tag)}> (known: {', '.join(children) or 'none'})",
                    "",
                    "left out",
                )

    def only(self, element: Element, tag: str, part: str) -> Element | None:
        """Return the child with a tag, or None; a second one is a defect."""
        elements = list(element.all(tag))
        for again in elements[1:]:
            self.repaired(
                again.line,
                part,
                f"<{tag}> occurs twice",
                f"line {elements[0].line} and here",
                "the first one is used",
            )
        return elements[0] if elements else None


def short_tag(tag: str) -> str:
    """Return the name of an element for errors, as one short line."""
    return short(tag)[1:-1]
