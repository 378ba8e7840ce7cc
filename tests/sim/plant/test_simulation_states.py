"""A simulation's states through pauses and resets, with the plant's own run control."""

from __future__ import annotations

import asyncio
from types import SimpleNamespace
from typing import Any, cast

import pytest

pytest.importorskip("rclpy")

from space_robot_sim.plant import simulation as module
from space_robot_sim.plant.loop import PlantLoop
from space_robot_sim.plant.run_control import RunControl
from space_robot_sim.plant.simulation import Simulation, SimulationState


class Loop(PlantLoop):
    """A plant's loop that flies nothing; a new one stands at tick 0, as after a start."""

    def __init__(self) -> None:
        self.control = RunControl()

    def tell_paused(self) -> None:
        """Tell nobody."""


@pytest.fixture
def simulation(monkeypatch: pytest.MonkeyPatch) -> Simulation:
    node = SimpleNamespace(
        is_active=True,
        loop=Loop(),
        settings=SimpleNamespace(reset_with=[], period=5e-4),
        log=lambda text: None,
    )

    async def restart(node: Any, others: list[str]) -> None:
        node.loop = Loop()

    monkeypatch.setattr(module, "restart", restart)
    return Simulation(cast(Any, node))


@pytest.mark.parametrize("stop", [False, True])
@pytest.mark.parametrize("paused", [False, True])
def test_a_reset_keeps_a_pause_and_stops_only_if_it_is_to(
    simulation: Simulation, paused: bool, stop: bool
) -> None:
    """One that is to stop is stopped until it is told anything else; else it is as before."""
    loop = cast(Any, simulation)._node.loop
    loop.control.begin(7)
    before = SimulationState.PAUSED if paused else SimulationState.PLAYING
    if paused:
        simulation.pause()
    assert simulation.state is before
    asyncio.run(simulation.reset(stop))
    control = cast(Any, simulation)._node.loop.control
    assert simulation.state is (SimulationState.STOPPED if stop else before)
    assert (control.tick, control.is_paused) == (0, paused or stop)
    simulation.pause()
    assert simulation.state is SimulationState.PAUSED
    asyncio.run(simulation.reset())
    assert simulation.state is SimulationState.PAUSED, (
        "a reset without stop is none, whatever was before"
    )
    simulation.resume()
    assert simulation.state is SimulationState.PLAYING
