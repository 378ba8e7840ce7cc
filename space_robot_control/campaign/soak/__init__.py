"""Flights back to back on the real graph, with faults drawn by chance, until a time is over."""

from .draw import draw_flight
from .run import soak

__all__ = ["draw_flight", "soak"]
