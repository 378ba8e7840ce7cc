"""A number that a campaign varies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass

from .changes import Changes
from .distributions import Distribution, Value


@dataclass(frozen=True)
class Variable(ABC):
    """A variable of a campaign: its name, how it is distributed, what its value changes."""

    name: str
    """With the element's own name, as ``robot.links[joint1].mass``."""
    key: str
    """Of ``vary`` in the file."""
    distribution: Distribution

    @property
    @abstractmethod
    def place(self) -> Hashable:
        """Key of the changed quantity, unique among the variables."""

    @abstractmethod
    def apply(self, value: Value, changes: Changes) -> None:
        """Change a flight as ``value``, drawn of the distribution, says."""

    @property
    def is_of_law(self) -> bool:
        """True if it changes the controller, whose nominal numbers each law has for itself."""
        return False

    @property
    def is_of_plant_robot(self) -> bool:
        """True if it changes the plant's robot alone, by construction to one that there can be."""
        return False
