"""Metrics, tables and figures of flights: those of Table V and further ones.

| module | metrics |
|---|---|
| `metrics` | RMS in both definitions, maxima, chatter |
| `spectrum` | power above 100 Hz |
| `ripple` | torque beyond the needs of the task, and its spectrum |
| `settling` | time until the error stays small after a motion |
| `actuation` | saturation, latency, commands that were not applied |
| `estimate_error` | error of the time-delay estimate |
| `pointing` | end effector's pointing in the inertial frame |
| `report` | all of them, as a dictionary |

All are accumulated over blocks of a flight (`blocks`), which may be longer than memory.
"""

from .excerpt import excerpt
from .metrics import attitude_angles, tracking_error
from .report import Analysis, analyze

__all__ = ["Analysis", "analyze", "attitude_angles", "excerpt", "tracking_error"]
