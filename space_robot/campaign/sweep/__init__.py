"""Laws beside one another over sensors and actuators: a campaign over a grid, summed up."""

from .run import sweep
from .study import sweep_study

__all__ = ["sweep", "sweep_study"]
