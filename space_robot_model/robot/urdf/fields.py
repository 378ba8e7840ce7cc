"""Strict reading of numbers and frames from attributes of URDF elements."""

from __future__ import annotations

import math
import re
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from ...elementary.rotations import rotation_of_rpy
from .elements import Element
from .findings import Report

Array = NDArray[np.float64]

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


HERE = UrdfFrame(np.eye(3), np.zeros(3))


class Fields:
    """Reads the attributes of the elements of one link or joint."""

    def __init__(self, report: Report, part: str) -> None:
        """Store the report for defects, and the name of the link or joint."""
        self.report, self.part = report, part

    def number(self, element: Element, name: str, default: float | None = None) -> float:
        """Return a number; without default the attribute is required."""
        text = element.attributes.get(name)
        if text is None and default is not None:
            return default
        if text is None:
            raise self.report.error(
                element.line, self.part, f"<{element.tag}> needs the attribute {name!r}"
            )
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
            raise self.report.error(
                element.line, self.part, f"{element.tag}.{name} must be {count} numbers", text or ""
            )
        return np.array([self._number(element, name, word) for word in words])

    def frame(self, origin: Element | None) -> UrdfFrame:
        """Return the frame of an ``<origin>``, relative to that of its element."""
        if origin is None:
            return HERE
        self.report.check_content(origin, self.part, (), ("xyz", "rpy"))
        zero = (0.0, 0.0, 0.0)
        rotation = rotation_of_rpy(self.vector(origin, "rpy", zero))
        return UrdfFrame(rotation, self.vector(origin, "xyz", zero))

    def _number(self, element: Element, name: str, text: str) -> float:
        value = float(text) if _NUMBER.fullmatch(text.strip()) else math.nan
        if abs(value) <= LARGEST:
            return value
        why = "is not a number" if math.isnan(value) else f"must be at most {LARGEST:g}"
        raise self.report.error(element.line, self.part, f"{element.tag}.{name} {why}", text)
