"""Metrics, tables and figures of flights: those of Table V and further ones.

| module | |
|---|---|
| `measure` | all metrics by name: units, meanings, numbers |
| `series`, `analysed_log` | series of a flight, their statistics, how a metric is declared |
| `pointing` | tracking errors, pointing of base and end effector |
| `torques` | torques, chatter, ripple beyond the needs of the task |
| `actuation` | settling, saturation, latency, commands that were not applied, limits of joints |
| `estimate_error` | error of the time-delay estimate |
| `tool_path` | the tool on the path of its mission |
| `momentum`, `external_torques` | momentum, and what changes it |
| `sizing` | demand on the base, and whether actuators can meet it |
| `mission_plan` | the same of a mission before it is flown, and a mission that needs less |
| `report` | what was flown and all metrics; `words` and `report_tables` say it |

Metrics are functions of a whole log, which may lie in a file; they take its rows block by block.
"""

from .analysed_log import excerpt
from .errors import attitude_angles, tracking_error
from .measure import Window, describe, measure
from .report import analyze

__all__ = [
    "Window",
    "analyze",
    "attitude_angles",
    "describe",
    "excerpt",
    "measure",
    "tracking_error",
]
