"""Laws beside one another over grades of sensors, each under the same random robots."""

from .run import sweep
from .scenario import Law, Sweep

__all__ = ["Law", "Sweep", "sweep"]
