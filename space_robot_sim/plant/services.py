"""Services of the plant's node: pause, resume, step, reset.

By std_srvs always, below the node's own name; by ROS's simulation_interfaces, in the namespace of
the robot, where that package is there.
"""

from __future__ import annotations

from collections.abc import Awaitable, Callable, Iterator
from enum import Enum
from functools import partial
from typing import Any

from rcl_interfaces.msg import IntegerRange, ParameterDescriptor
from rclpy.callback_groups import ReentrantCallbackGroup
from std_srvs.srv import Trigger

from space_robot_msgs_py.errors import FlightError, InputError, SpaceRobotError
from space_robot_msgs_py.ros.managed_node import ManagedNode
from space_robot_msgs_py.ros.service_calls import until

from .loop import PlantLoop
from .settings import MOST_TICKS, PlantNodeSettings


class SimulationState(Enum):
    """States of a simulation, as simulation_interfaces has them."""

    STOPPED = "stopped"
    """Reset and held at tick 0, or not active at all."""
    PLAYING = "playing"
    PAUSED = "paused"


class Simulation:
    """Control of a node's plant: pause, step and reset.

    All raise an `InputError` if the plant is not active, or what is asked for makes no sense then.
    """

    def __init__(self, node: ManagedNode[PlantNodeSettings]) -> None:
        self._node = node
        self._is_resetting = False
        self._is_stopped = False
        """True after a reset that stops, until the next request."""

    @property
    def state(self) -> SimulationState:
        """The present state."""
        if not self._is_running or self._is_stopped:
            return SimulationState.STOPPED
        return SimulationState.PAUSED if self._loop.control.is_paused else SimulationState.PLAYING

    async def pause(self) -> str:
        """Hold the plant at the present tick; return the answer for the caller."""
        has_changed = self._loop.control.pause()
        return self._report(f"{'' if has_changed else 'already '}paused at {self._now}")

    async def resume(self) -> str:
        """Let the plant run on; return the answer for the caller."""
        has_changed = self._loop.control.resume()
        return self._report(f"{'goes on' if has_changed else 'runs already'} at {self._now}")

    async def step(self, ticks: int) -> str:
        """Go ``ticks`` further; return the answer for the caller once the plant is held again."""
        loop = self._loop
        if self._is_stopped:
            raise InputError("the simulation is stopped: pause it before it is stepped")
        target = loop.control.step(ticks)
        # a reset or a shutdown replaces the loop: then nobody would end this wait
        await until(lambda: loop.control.is_held or self._node.loop is not loop)
        reached = loop.control.tick
        if reached != target:
            raise FlightError(f"the step ended at tick {reached} of {target}")
        return f"stepped to {self._at(reached)}"

    async def reset(self, stop: bool = False) -> str:
        """Take the graph back to its start, where it stays paused if it was, or is to ``stop``."""
        keep = self._loop.control.is_paused or stop
        settings = self._node.settings
        assert settings is not None
        self._is_resetting = True
        try:
            await self._node.restart([name for name in settings.reset_with if name])
        finally:
            self._is_resetting = False
        if keep:
            self._loop.control.pause()
        text = self._report(f"reset, {'paused' if keep else 'goes on'} at {self._now}")
        self._is_stopped = stop
        return text

    @property
    def _is_running(self) -> bool:
        return self._node.is_active and not self._is_resetting

    @property
    def _loop(self) -> PlantLoop:
        loop = self._node.loop
        if not self._is_running or not isinstance(loop, PlantLoop):
            raise InputError("the plant is not active")
        return loop

    @property
    def _now(self) -> str:
        return self._at(self._loop.control.tick)

    def _at(self, tick: int) -> str:
        settings = self._node.settings
        assert settings is not None
        return f"tick {tick} ({tick * settings.period:.4f} s)"

    def _report(self, text: str) -> str:
        self._is_stopped = False
        self._loop.report_pause()
        self._node.log(text)
        return text


STEP_TICKS = "step_ticks"


FEATURES = (
    "SIMULATION_RESET",
    "SIMULATION_STATE_GETTING",
    "SIMULATION_STATE_SETTING",
    "SIMULATION_STATE_PAUSE",
    "STEP_SIMULATION_SINGLE",
    "STEP_SIMULATION_MULTIPLE",
)
"""Names of constants of SimulatorFeatures.

SIMULATION_RESET_TIME and SIMULATION_RESET_STATE are missing: they announce that each can be reset
alone.
"""
ABOUT = "space_robot: time, state, controller, mission and bag are reset together"

Service = tuple[Any, str, Callable[[Any, Any], Any]]
"""Type, name and callback of a service."""


def standard_services(simulation: Simulation) -> Iterator[Service]:
    """Yield the services; none without the package."""
    try:
        from simulation_interfaces import msg, srv
    except ImportError:
        return
    standard = StandardServices(simulation, msg, srv)
    yield srv.GetSimulatorFeatures, "get_simulator_features", standard.get_features
    yield srv.GetSimulationState, "get_simulation_state", standard.get_state
    yield srv.SetSimulationState, "set_simulation_state", standard.set_state
    yield srv.StepSimulation, "step_simulation", standard.step
    yield srv.ResetSimulation, "reset_simulation", standard.reset


class StandardServices:
    """The callbacks."""

    def __init__(self, simulation: Simulation, msg: Any, srv: Any) -> None:
        """``msg``, ``srv``: the package's modules."""
        self._simulation = simulation
        self._features, self._result, self._srv = msg.SimulatorFeatures, msg.Result, srv
        states = msg.SimulationState
        self._numbers = {s: getattr(states, f"STATE_{s.name}") for s in SimulationState}

    def get_features(self, request: Any, response: Any) -> Any:
        """Return the supported features."""
        response.features.features = [getattr(self._features, name) for name in FEATURES]
        response.features.custom_info = ABOUT
        return response

    def get_state(self, request: Any, response: Any) -> Any:
        """Return the state of the simulation."""
        response.state.state = self._numbers[self._simulation.state]
        return self._end(response, self._result.RESULT_OK)

    async def set_state(self, request: Any, response: Any) -> Any:
        """Play, pause, or stop, which is a reset that stays paused."""
        simulation, kind = self._simulation, self._srv.SetSimulationState.Response
        wanted = {number: state for state, number in self._numbers.items()}.get(request.state.state)
        if wanted is None:
            text = "a simulation can be told to play, to pause and to stop"
            return self._end(response, self._result.RESULT_FEATURE_UNSUPPORTED, text)
        if wanted is simulation.state:
            return self._end(response, kind.ALREADY_IN_TARGET_STATE)
        acts: dict[SimulationState, Callable[[], Awaitable[str]]] = {
            SimulationState.PLAYING: simulation.resume,
            SimulationState.PAUSED: simulation.pause,
            SimulationState.STOPPED: partial(simulation.reset, stop=True),
        }
        return await self._answer(acts[wanted](), response, kind.STATE_TRANSITION_ERROR)

    async def step(self, request: Any, response: Any) -> Any:
        """Step; answered once the steps are done."""
        step = self._simulation.step(request.steps)
        return await self._answer(step, response, self._result.RESULT_OPERATION_FAILED)

    async def reset(self, request: Any, response: Any) -> Any:
        """Reset time and state together."""
        # a flight at tick 0 has one state, and its state one tick: neither can be reset alone
        kind = self._srv.ResetSimulation.Request
        both = kind.SCOPE_TIME | kind.SCOPE_STATE
        if request.scope != kind.SCOPE_DEFAULT and request.scope & both != both:
            text = "only time and state together can be reset"
            return self._end(response, self._result.RESULT_FEATURE_UNSUPPORTED, text)
        reset = self._simulation.reset()
        return await self._answer(reset, response, self._result.RESULT_OPERATION_FAILED)

    async def _answer(self, act: Awaitable[str], response: Any, failed: int) -> Any:
        try:
            await act
        except (InputError, FlightError) as error:
            return self._end(response, failed, str(error))
        return self._end(response, self._result.RESULT_OK)

    def _end(self, response: Any, result: int, text: str = "") -> Any:
        response.result.result, response.result.error_message = result, text
        return response


def offer_services(node: ManagedNode[PlantNodeSettings]) -> None:
    """Offer the services, in all states of the node's lifecycle."""
    simulation = Simulation(node)
    descriptor = ParameterDescriptor(
        description="ticks per step of a paused plant (service ~/step)",
        integer_range=[IntegerRange(from_value=1, to_value=MOST_TICKS)],
    )
    node.declare_parameter(STEP_TICKS, 1, descriptor)
    group = ReentrantCallbackGroup()  # a step is served for as long as it takes, others meanwhile

    async def step() -> str:
        return await simulation.step(int(node.get_parameter(STEP_TICKS).value))

    for act in (simulation.pause, simulation.resume, step, simulation.reset):
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
