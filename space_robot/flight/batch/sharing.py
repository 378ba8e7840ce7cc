"""Which flights can fly in one batch."""

from __future__ import annotations

from collections.abc import Hashable, Iterable, Iterator
from functools import cache
from typing import Any

from space_robot_control.controller.signals import ControllerMemory
from space_robot_control.laws.base import CompiledLaw
from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.tick import PlantMemory

from ..plan import Flight


def reason_to_fly_alone(flight: Flight) -> str:
    """Return why a flight cannot be in a batch, in a line; empty if it can."""
    if flight.plant_settings.has_message_faults:
        return "messages between plant and controller have faults"
    if flight.flies_by_messages:
        return "the flight code in C answers"
    for law in (flight.law, *(law for _, law in flight.swaps)):
        kind: Any = type(law)  # classes are hashable
        if why := _of_law(kind):
            return why
    return ""


@cache
def _of_law(law: Any) -> str:
    """Return why a class of laws flies alone; one that cannot be compiled is tried once."""
    if not issubclass(law, CompiledLaw):
        return f"law {law.name!r} is plain Python"
    try:
        law.function(WIDTH)
    except InputError as error:
        return f"law {law.name!r} cannot be compiled for eight flights: {error}"
    return ""


def batch_key(flight: Flight) -> Hashable:
    """Return what flights of one batch have in common, of a flight that can be in one."""
    controller = flight.controller
    return (
        plant_key(flight.plant),
        flight.ticks,
        ControllerMemory.uniform_numbers(controller.block),
        flight.controller_settings.telemetry_decimation,
        flight.mission_settings.chunk_ticks,
        (type(controller.law), controller.law.estimate),
        tuple((tick, type(law), law.estimate) for tick, law in flight.swaps),
    )


def plant_key(plant: Plant) -> Hashable:
    """Return what plants that are stepped in lanes have in common."""
    return (
        plant.tick,
        plant.period,
        plant.names,
        plant.command_delay_buffer.shape,
        plant.measures_truth,
        PlantMemory.uniform_numbers(plant.block),
    )


def batches(flights: Iterable[tuple[int, Flight]]) -> Iterator[list[tuple[int, Flight]]]:
    """Yield numbered flights in groups of up to eight that fly together, as soon as one is full.

    A flight that cannot be in a batch, or has no other to share one with, is a group by itself.
    """
    waiting: dict[Hashable, list[tuple[int, Flight]]] = {}
    for number, flight in flights:
        if reason_to_fly_alone(flight):
            yield [(number, flight)]
            continue
        key = batch_key(flight)
        group = waiting.setdefault(key, [])
        group.append((number, flight))
        if len(group) == WIDTH:
            yield waiting.pop(key)
    yield from waiting.values()
