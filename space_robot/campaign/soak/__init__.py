"""Random flights with faults, back to back on the real graph, until a time is over."""

from .run import soak
from .sampling import sample_flight

__all__ = ["sample_flight", "soak"]
