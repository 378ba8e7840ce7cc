"""What is varied in a campaign: which numbers each run draws, and what they change."""

from .draws import Draws

__all__ = ["Draws"]
