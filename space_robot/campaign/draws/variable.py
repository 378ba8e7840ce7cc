"""Base class of the quantities that a campaign varies."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Hashable
from dataclasses import dataclass

from .changes import Changes
from .distributions import Distribution, Value


@dataclass(frozen=True)
class Variable(ABC):
    """A variable of a campaign: name, distribution, and effect on a flight."""

    name: str
    """With the name of the element, such as ``robot.links[joint1].mass``."""
    key: str
    """Key of ``vary`` in the file."""
    distribution: Distribution

    @property
    @abstractmethod
    def place(self) -> Hashable:
        """Key of the changed quantity, unique among the variables."""

    @abstractmethod
    def apply(self, value: Value, changes: Changes) -> None:
        """Apply ``value``, drawn from the distribution, to a flight."""

    @property
    def is_of_law(self) -> bool:
        """True if it changes the controller, whose nominal settings depend on the law."""
        return False

    @property
    def is_of_plant_robot(self) -> bool:
        """True if it changes only the plant's robot, which stays physically consistent."""
        return False
