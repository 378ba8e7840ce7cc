"""What a plant tells of itself: the flight's description in a bag, and its actuators' health.

Independent of ROS.
"""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot

from ..environment.disturbance_table import DisturbanceTable
from ..environment.friction import coefficients
from .plant import Plant
from .settings import PlantNodeSettings


def plant_description(
    robot: Robot, content: Mapping[str, Any], plant: Plant, settings: PlantNodeSettings
) -> dict[str, Any]:
    """Return what is flown, without time or machine: the same for the same settings.

    ``content`` are the robot's numbers, for `Robot.from_dict`.
    """
    kinds = zip(robot.all_joint_names, robot.is_prismatic, strict=True)
    prismatic = [name for name, is_prismatic in kinds if is_prismatic]
    faults = [text for text in settings.faults if text.strip()]
    events = [str(exchange.event) for exchange in plant.captures.exchanges]
    table, scale = settings.disturbance.table, settings.disturbance.table_scale
    factor = "" if scale == 1.0 else f", times {scale:g}"
    return {
        "case": settings.case,
        "sensors": settings.sensors,
        "actuators": settings.actuators,
        **({} if settings.base_actuation == "ideal" else {"base_actuators": actuators(settings)}),
        "robot": robot.name,
        "period": settings.period,
        "command_latency_ticks": settings.command_latency_ticks,
        "friction": bool(coefficients(robot, settings.friction).any()),
        "realtime": settings.realtime,
        "seed": settings.fault_seed,
        **({"faults": faults} if faults else {}),
        **({"events": events} if events else {}),
        **({"disturbance": f"{DisturbanceTable.parse(table).label}{factor}"} if table else {}),
        **({"orbit": settings.orbit} if settings.has_orbit else {}),
        **({"prismatic_joints": prismatic} if prismatic else {}),
        **({"branches": list(branches)} if len(branches := robot.branches) > 1 else {}),
        "robot_file": dict(content),
    }


def actuators(settings: BaseActuatorSettings) -> dict[str, Any]:
    """Return the numbers of the base's actuators."""
    return settings.model_dump(include=set(BaseActuatorSettings.model_fields))


Values = dict[str, float | int | str]


class ActuatorHealth:
    """State of the base's actuators from one report to the next. Independent of ROS."""

    def __init__(self, plant: Plant) -> None:
        self._plant = plant
        self._before: dict[str, int] = {}

    @property
    def values(self) -> Values:
        """Diagnostic values by name with unit; empty for an ideal base."""
        return {**self._of_wheels(), **self._of_thrusters()}

    def saturated(self) -> str:
        """Return the names of wheels that were at a limit since the last call."""
        ticks = self._plant.memory.actuators.wheels.saturated_ticks
        now = {name: int(ticks[k]) for k, name in enumerate(self._plant.names.wheels)}
        names = [name for name, count in now.items() if count > self._before.get(name, 0)]
        self._before = now
        return ", ".join(names)

    def _of_wheels(self) -> Values:
        wheels, speeds = self._plant.memory.actuators.wheels, self._plant.truth.wheel_velocities
        names, values = self._plant.names.wheels, Values()
        for k, name in enumerate(names):
            if np.isfinite(wheels.max_momentum[k]):
                share = wheels.inertia[k] * speeds[k] / wheels.max_momentum[k]
                values[f"momentum_percent: {name}"] = float(100.0 * share)
            if wheels.saturated_ticks[k]:
                values[f"saturated_ticks: {name}"] = int(wheels.saturated_ticks[k])
        failed = [name for k, name in enumerate(names) if wheels.failed[k]]
        return {**values, **({"failed": ", ".join(failed)} if failed else {})}

    def _of_thrusters(self) -> Values:
        names, thrusters = self._plant.names.thrusters, self._plant.memory.actuators.thrusters
        if not names:
            return {}
        values: Values = {
            "pulses": int(thrusters.pulses.sum()),
            "propellant_used_kg": float(thrusters.burnt),
        }
        if np.isfinite(thrusters.propellant):
            values["propellant_left_kg"] = float(thrusters.propellant)
        for what in ("stuck_on", "stuck_off"):
            if stuck := [name for k, name in enumerate(names) if getattr(thrusters, what)[k]]:
                values[what] = ", ".join(stuck)
        return values
