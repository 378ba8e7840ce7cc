"""Variations of a resolved scenario in numbers only: no file is read again.

A draw of a campaign changes masses, gains, single parameters, faults and the seed. All else is
that of the nominal scenario, whose files were read and checked once.
"""

from __future__ import annotations

import copy
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

from pydantic import BaseModel, ValidationError

from space_robot_control.controller.gains import PARAMETERS, check_gains
from space_robot_control.laws import ControlLaw
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.files import GIVEN, Tree, merge, nest
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.plant.settings import PLANT_KINDS, PlantNodeSettings

from .faults import KINDS, PROCESS_KINDS
from .resolved import ResolvedScenario

OF_PLANT = frozenset(
    {
        *("friction", "disturbance", "payload", "initial_joints_deg", "initial_quaternion"),
        *("orbital_elements", "gravity", "atmosphere", "sunlight", "magnetism"),
        "initial_rate_deg_s",
        *("torque_echo", "echo_scale", "echo_bias", "substeps", "command_latency_ticks"),
        *("drive_scale", "drive_bias", "drive_step", "drive_dead_band", "drive_lag"),
        *("base_torque_limit", "joint_torque_limit", *SensorSettings.model_fields),
    }
)
"""Parameters of the plant on which nothing else in a scenario depends."""
OF_SENSORS = frozenset(SensorSettings.model_fields)
"""Those that navigation assumes to be known, if they are given without a file."""
OF_ORBIT = frozenset({"orbital_elements", "gravity", "sunlight"})
"""Those that a mission assumes to be known, if it depends on the orbit."""


@dataclass
class Variation:
    """Numbers that differ from a nominal scenario's."""

    seed: int
    plant_robot: Robot | None = None
    faults: list[str] = field(default_factory=list)
    """All faults of the flight, as options."""
    parameters: Mapping[str, Mapping[str, Any]] = field(default_factory=dict)
    """By node and dotted name."""


def varied(nominal: ResolvedScenario, variation: Variation) -> ResolvedScenario | None:
    """Return a nominal scenario with other numbers; it shares what does not change.

    Returns:
        The scenario that `resolve` would give; None if it has to be resolved anew, also to tell
        what is wrong with a number.
    """
    parameters = {node: nest(values) for node, values in variation.parameters.items() if values}
    of_plant = parameters.pop("plant", {})
    gains = parameters.pop("controller", {})
    known = {name: law for name, law in nominal.laws.items() if isinstance(gains.get(name), dict)}
    if parameters or known.keys() != gains.keys() or not of_plant.keys() <= OF_PLANT:
        return None
    if of_plant.keys() & OF_SENSORS and nominal.plant.sensors == GIVEN:
        return None
    if of_plant.keys() & OF_ORBIT and nominal.reference.uses_orbit:
        return None
    options = nominal.options.model_copy(
        update={"seed": variation.seed, "faults": variation.faults}
    )
    try:
        plant = _plant(nominal.plant, of_plant, options.faults_of(PLANT_KINDS), variation.seed)
        laws = _laws(nominal, gains)
    except (ValidationError, ValueError):
        return None
    robots = nominal.robots
    return replace(
        nominal,
        options=options,
        plant=plant,
        gains=merge(nominal.gains, gains),
        robots=robots.with_plant(variation.plant_robot) if variation.plant_robot else robots,
        laws=laws,
        swaps=[(tick, laws[law.name]) for tick, law in nominal.swaps],
        process_faults=parse_faults(options.faults_of(PROCESS_KINDS), KINDS),
    )


def _plant(
    nominal: PlantNodeSettings, changes: Tree, faults: list[str], seed: int
) -> PlantNodeSettings:
    """Return the plant's settings with changes, each field of which is validated."""
    update: Tree = {"faults": faults or [""], "fault_seed": seed}
    for name, value in changes.items():
        now = getattr(nominal, name)
        if isinstance(now, BaseModel):
            update[name] = type(now).model_validate(merge(now.model_dump(), value))
        else:
            update[name] = value
    plain = {k: v for k, v in update.items() if not isinstance(v, BaseModel)}
    checked = type(nominal).model_validate(plain)
    return nominal.model_copy(update=update | {name: getattr(checked, name) for name in plain})


def _laws(nominal: ResolvedScenario, gains: Tree) -> dict[str, ControlLaw]:
    """Return the laws; those that fly, or have other gains, are copies with their own memory."""
    flying = {nominal.law.name, *(law.name for _, law in nominal.swaps)}
    laws = {}
    for name, law in nominal.laws.items():
        laws[name] = copy.deepcopy(law) if name in flying | gains.keys() else law
        if name in gains:
            axes = len(law.memory.s)
            own = {**law.gain_values, **gains[name]}
            laws[name].gain_values = check_gains(own, type(law), axes, PARAMETERS)
    return laws
