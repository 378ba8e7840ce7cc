"""A sweep as a campaign: the grid of sensors and actuators, and masses that are off."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

from space_robot_msgs_py.config.validation import validate

from ..study import Study

SENSORS, ACTUATORS = "scenario.sensors", "scenario.actuators"
"""Names of the variables of the grid."""
OFF = ("robot.base.mass", "robot.base.inertia", "robot.links[*].mass", "robot.links[*].inertia")


def sweep_study(
    laws: Sequence[str],
    sensors: Sequence[str],
    actuators: Sequence[str] = ("ideal",),
    draws: int = 1,
    spread: float = 0.0,
    common: Mapping[str, Any] | None = None,
) -> Study:
    """Return the campaign of a sweep: every law with all sensors and actuators.

    Args:
        laws: each as ``LAW`` or ``LAW=GAINS``.
        sensors: names or paths.
        actuators: names or paths.
        draws: flights of every law with each sensors and actuators; noise and robot are the same
            for all of them.
        spread: largest relative error of every mass and of every inertia; a body's inertia is off
            as a whole. 0: the nominal robot.
        common: options of `Scenario` that all flights share.

    Raises:
        InputError: an option that cannot be.
    """
    off = {"uniform": [1.0 - spread, 1.0 + spread], "relative": True}
    content = {
        "scenario": dict(common or {}),
        "laws": list(laws),
        "vary": {
            ACTUATORS: {"grid": list(actuators)},
            SENSORS: {"grid": list(sensors)},
            **dict.fromkeys(OFF if spread else (), off),
        },
        "runs": draws * len(sensors) * len(actuators),
    }
    return validate(Study, content, "options").named("options")
