"""Pictures of flights for print: 180 mm wide, from flight logs to matplotlib figures.

Nothing here uses pyplot or leaves a trace in matplotlib's settings, so pictures may be drawn in
worker processes. The same log gives the same bytes.
"""

from .base_torque import BaseTorque
from .comparison import chatter, junctions
from .files import save_figure
from .overlay import errors_and_torques, latency_histogram, pointing
from .single_flight import control_results, desired_joints

__all__ = [
    "BaseTorque", "chatter", "control_results", "desired_joints", "errors_and_torques", "junctions",
    "latency_histogram", "pointing", "save_figure",
]  # fmt: skip
