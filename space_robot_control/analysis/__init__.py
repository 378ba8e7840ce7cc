"""How well a flight was flown: the figures of merit of Table V, and chatter."""

from .metrics import analyse, tracking_error

__all__ = ["analyse", "tracking_error"]
