"""Figures of flights for print, 180 mm wide, drawn by matplotlib from flight logs.

Nothing here uses pyplot or changes matplotlib's settings, so figures may be drawn in worker
processes. The same log gives the same bytes.
"""

from .base_torque import chatter, junctions
from .overlay import errors_and_torques, latency_histogram, pointing, ripple
from .single_flight import control_results, desired_joints, kind_figure, limit_cycle
from .style import save_figure

__all__ = [
    "chatter",
    "control_results",
    "desired_joints",
    "errors_and_torques",
    "junctions",
    "kind_figure",
    "latency_histogram",
    "limit_cycle",
    "pointing",
    "ripple",
    "save_figure",
]
