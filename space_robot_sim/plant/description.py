"""The plant's part of the flight description in a bag. Independent of ROS."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

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

    Args:
        robot: the plant's.
        content: its numbers, for `Robot.from_dict`.
        plant: made of both.
        settings: of the plant's node.
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
