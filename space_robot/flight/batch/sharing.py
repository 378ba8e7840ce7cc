"""Which flights can fly in one batch."""

from __future__ import annotations

from collections.abc import Hashable

from space_robot_control.controller.kernels import ControllerMemory
from space_robot_control.laws.base import ControlLaw
from space_robot_control.laws.compiled import CompiledLaw
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import PlantMemory

from ..plan import Flight


def reason_to_fly_alone(flight: Flight) -> str:
    """Return why a flight cannot be in a batch, in a line; empty if it can."""
    if flight.plant_settings.has_message_faults:
        return "messages between plant and controller have faults"
    for law in (flight.law, *(law for _, law in flight.swaps)):
        if why := _of_law(law):
            return why
    return ""


def _of_law(law: ControlLaw) -> str:
    if not isinstance(law, CompiledLaw):
        return f"law {law.name!r} is plain Python"
    try:
        type(law).function(WIDTH)
    except InputError as error:
        return f"law {law.name!r} cannot be compiled for eight flights: {error}"
    return ""


def batch_key(flight: Flight) -> Hashable:
    """Return what flights of one batch have in common, of a flight that can be in one."""
    plant, controller = flight.plant, flight.controller
    return (
        plant.tick,
        flight.ticks,
        flight.period,
        plant.names,
        plant.command_delay_buffer.shape,
        plant.measures_truth,
        PlantMemory.uniform_numbers(plant.block),
        ControllerMemory.uniform_numbers(controller.block),
        flight.controller_settings.telemetry_decimation,
        flight.mission_settings.chunk_ticks,
        type(controller.law),
        tuple((tick, type(law)) for tick, law in flight.swaps),
    )
