"""Laws beside one another over sensors and actuators, each under the same random robots."""

from .run import sweep
from .scenario import Law, Sweep

__all__ = ["Law", "Sweep", "sweep"]
