"""Services of the plant's node: pause, resume, step, reset.

By std_srvs always, below the node's own name; by ROS's simulation_interfaces, in the namespace of
the robot, where that package is there.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable
from functools import partial
from typing import Any

from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.managed_node import ManagedNode

from .settings import MOST_TICKS, PlantNodeSettings
from .simulation import Simulation
from .standard_services import standard_services

STEP_TICKS = "step_ticks"


def offer_services(node: ManagedNode[PlantNodeSettings]) -> None:
    """Offer the services, in all states of the node's lifecycle."""
    simulation = Simulation(node)
    descriptor = ParameterDescriptor(
        description="ticks per step of a paused plant (service ~/step)",
        integer_range=[IntegerRange(from_value=1, to_value=MOST_TICKS)],
    )
    node.declare_parameter(STEP_TICKS, 1, descriptor)
    group = ReentrantCallbackGroup()  # a step is served for as long as it takes, others meanwhile

    async def pause() -> str:
        return simulation.pause()

    async def resume() -> str:
        return simulation.resume()

    async def step() -> str:
        return await simulation.step(int(node.get_parameter(STEP_TICKS).value))

    for act in (pause, resume, step, simulation.reset):
        node.create_service(
            Trigger, f"~/{act.__name__}", partial(_serve, act), callback_group=group
        )
    for kind, name, callback in standard_services(simulation):
        node.create_service(kind, name, callback, callback_group=group)


async def _serve(act: Callable[[], Awaitable[str]], request: Any, response: Any) -> Any:
    try:
        response.message, response.success = await act(), True
    except SpaceRobotError as error:
        response.message, response.success = str(error), False
    return response
