"""The simulated world: the robot as data, its dynamics, what acts on it, and the plant."""

from .dynamics import bias_force, forward_dynamics, mass_matrix
from .robot import Robot

__all__ = ["Robot", "bias_force", "forward_dynamics", "mass_matrix"]
