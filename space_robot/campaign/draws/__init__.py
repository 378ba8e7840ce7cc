"""Random draws of a campaign: distributions, and the quantities that they vary."""

from .draws import Draws

__all__ = ["Draws"]
