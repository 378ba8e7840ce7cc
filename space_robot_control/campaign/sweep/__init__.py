"""Laws beside one another over sensors and actuators, each under the same random robots."""

from ..study import Law
from .run import sweep
from .scenario import Sweep

__all__ = ["Law", "Sweep", "sweep"]
