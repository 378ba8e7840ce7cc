"""The controller: measured state and reference in, torque out, every tick. Independent of ROS."""

from __future__ import annotations

from collections.abc import Mapping
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from typing_extensions import Self

from space_robot_model.elementary.matrices import norm
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.kernels import RecordFunction
from space_robot_msgs_py.compiled.records import Block, RecordOwner, assign
from space_robot_msgs_py.errors import SingularAttitudeError, UnusableStateError
from space_robot_msgs_py.samples import Command, RobotState

from ..allocation.allocation import Allocation, Diagnosis, allocation_code, diagnose
from ..allocation.settings import AllocationSettings
from ..laws import ControlLaw, Signals
from ..laws.base import force_of
from ..navigation.navigation import Navigation
from ..navigation.rate_filters import low_pass_weight
from ..navigation.settings import NavigationFilterSettings
from .settings import ControllerNodeSettings
from .signals import (
    LARGEST,
    NOT_UNIT,
    SINGULAR,
    TOO_LARGE,
    USABLE,
    ControllerMemory,
    compute_signals,
)
from .tick import apply_transfer, engage

Array = NDArray[np.float64]

TRANSFER_S = 0.02
"""Time in which a new law changes over from the applied force to its own, s."""


class ControllerSnapshot(NamedTuple):
    """Saved state of a controller between two ticks; made by `Controller.save`."""

    block: Block
    """Record of a `ControllerMemory`."""
    law: str
    """Name of the law in force."""
    saved_law: dict[str, Any]
    """State of the law, made by `ControlLaw.save`."""
    tick: int
    torque: Array
    """Torque of the last command."""


class Controller(RecordOwner):
    """Controller with one law on a nominal robot model; laws can be swapped between ticks.

    The time-delay pair is kept for all laws, and a law takes over from the applied force, so
    neither a swap nor a start in the middle of a flight causes a jump of the torque.
    A copy, also one by `pickle`, has a copy of the law in force and answers the same.
    """

    _views = ("_memory", "_reference", "_address", "_actuators", "signals", "allocate")

    def __init__(
        self,
        robot: Robot,
        law: ControlLaw,
        period: float,
        acceleration_filter_hz: float = 0.0,
        navigation: NavigationFilterSettings | None = None,
        actuators: BaseActuatorSettings | None = None,
        allocation: AllocationSettings | None = None,
    ) -> None:
        """Build it for a robot and a law.

        Args:
            robot: as the controller knows it; the laws have its `Robot.nominal`.
            law: in force at the beginning.
            period: s.
            acceleration_filter_hz: corner of the low-pass of the time-delay pair (0: none).
            navigation: settings of the navigation filter (None: the laws see what is measured).
            actuators: of the base, as the controller knows them (None: ideal ones).
            allocation: how it uses them (None: as by default).
        """
        actuators = actuators or BaseActuatorSettings()
        self.names = actuators.robot_names(robot)
        """Names of all measured and commanded quantities."""
        self.period = period
        self.block = ControllerMemory.block(robot.n)
        """The controller's `ControllerMemory`, for compiled loops."""
        memory: ControllerMemory = self.block[0]
        # J0 of q_e = 1 is E / 2
        assign(memory, last_jacobian_inverse=2.0 * np.eye(3))
        assign(memory.signals, model=robot.nominal.model)
        assign(memory.signals, base_is_free=not actuators.controls_base)
        assign(memory, controls_base=actuators.controls_base)
        assign(memory, transfer_ticks=max(1, round(TRANSFER_S / period)))
        assign(memory.pair, smoothing=low_pass_weight(acceleration_filter_hz, period))
        if navigation:
            assign(memory, navigation=Navigation.build(robot.n, navigation, period))
        if actuators.names:
            how = allocation or AllocationSettings()
            assign(memory, allocation=Allocation.build(robot.n, actuators, how, period))
        self._robot = robot.nominal
        self._bind_views()
        self.last_command = Command(-1, np.zeros(len(self.names.commanded)))
        """Command of the last tick, overwritten by the next."""
        self.valves = slice(robot.n + 3 + actuators.wheel_count, None)
        """The part of a command that opens thrusters."""
        self.law = law

    @classmethod
    def from_settings(
        cls,
        robot: Robot,
        law: ControlLaw,
        settings: ControllerNodeSettings,
        actuators: BaseActuatorSettings,
    ) -> Self:
        """Build it as the settings of its node say, for a robot, a law and assumed actuators."""
        corner, filters = settings.acceleration_filter_hz, settings.filter_settings
        return cls(robot, law, settings.period, corner, filters, actuators, settings.allocation)

    def _bind_views(self) -> None:
        self._memory: ControllerMemory = self.block[0]
        self._reference: Block = self.block["signals"]["reference"]
        allocated: Block = self.block["allocation"]
        self._address = allocated.ctypes.data
        self._actuators: Array = allocated["command"][0, : len(self.names.actuators)]
        """Command for each actuator."""
        self.signals = Signals.view(self.block["signals"])
        self.signals.robot = self._robot
        """The signals that the law saw at the last tick."""

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore attributes, and create views of the block."""
        ControllerMemory.dtype(len(state["names"].joints))  # that compiled code knows its layout
        super().__setstate__(state)

    @property
    def law(self) -> ControlLaw:
        """The law in force; setting it makes it `engage`."""
        return self._law

    @law.setter
    def law(self, law: ControlLaw) -> None:
        self._law = law
        self.engage()

    def use(self, law: ControlLaw) -> bool:
        """Let ``law`` be in force, if it is another one; return whether it is."""
        is_other = self._law is not law
        if is_other:
            self.law = law
        return is_other

    def engage(self) -> None:
        """Reset the law and let it take over from the applied force at the next tick."""
        self._law.reset()
        engage(self.block)

    def move_to(self, block: Block) -> None:
        """Keep the memory in another ``block`` from now on, beside that of other flights."""
        block[:] = self.block
        self.block = block
        self._bind_views()

    def save(self) -> ControllerSnapshot:
        """Save the state of the controller and its law."""
        command = self.last_command
        return ControllerSnapshot(
            self.block.copy(), self._law.name, self._law.save(), command.tick, command.torque.copy()
        )

    def restore(self, snapshot: ControllerSnapshot, laws: Mapping[str, ControlLaw]) -> None:
        """Restore a saved state; ``laws`` holds laws by name, including the saved one."""
        self.block[:] = snapshot.block
        self._law = laws[snapshot.law]
        self._law.restore(snapshot.saved_law)
        self.last_command.tick = snapshot.tick
        self.last_command.torque[:] = snapshot.torque

    def update(self, state: RobotState, reference: Block) -> Command:
        """Return the torque for a measured state.

        Args:
            state: the plant's measurements, with the torque it applied since the last tick.
            reference: of a `Reference`.

        Returns:
            The command for this tick, valid until the next call.

        Raises:
            UnusableStateError: the state is not finite, beyond `LARGEST`, or its quaternion not
                unit; nothing was remembered of it.
            SingularAttitudeError: the base is 180 degrees from its desired attitude.
            LawError: the code of the law failed.
        """
        law = self._law
        self._reference[0] = reference[0]  # five times faster than all fields of an array of one
        status = compute_signals(self.block, state.tick, state.block, *law.needs, self.period)
        if status != USABLE:
            raise unusable(status, state.tick, state.quaternion)
        return self.command_for(state.tick, force_of(law, self.signals, state.tick))

    def command_for(self, tick: int, force: Array) -> Command:
        """Return the command for the force (m,) of the law, N m, after `compute_signals`."""
        apply_transfer(self.block, tick, force, self.last_command.torque)
        return self._allocate(tick)

    def allocate_torque(self, state: RobotState, torque: Array) -> Command:
        """Return the command for a torque (m,), N m, without a law, as on the bench."""
        allocation = self._memory.allocation
        assign(
            allocation,
            reported_speeds=state.wheel_velocities,
            reported_torques=state.wheel_torques,
            demand=torque[:3],
        )
        allocation.torquers.magnetic_field[:] = state.magnetic_field
        self.last_command.torque[: len(torque)] = torque
        return self._allocate(state.tick)

    def _allocate(self, tick: int) -> Command:
        """Allocate the base torque to the base's actuators, if it has any."""
        command = self.last_command
        if self._actuators.size:
            joints = 0  # the layout of an `Allocation` is the same for any number of them
            self.allocate.call(self._address, joints, tick)
            command.torque[-self._actuators.size :] = self._actuators
        command.tick = tick
        return command

    @cached_property
    def allocate(self) -> RecordFunction:
        """The allocation of the torque on the base, for compiled loops; may have to be compiled."""
        return allocation_code(is_used=bool(self._actuators.size))

    @property
    def allocation(self) -> Diagnosis:
        """Diagnosis of the base's actuators."""
        return diagnose(self._memory.allocation)

    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """Telemetry of the last tick: s, u, N_hat and e, (m,) each."""
        memory, signals = self._law.memory, self.signals
        return memory.s, memory.u, signals.n_hat, signals.error


STATUS_WORDS = (
    *("usable", "state not finite", "state too large", "quaternion not unit"),
    "attitude error near 180 degrees",
)
"""What is wrong with a state, in a word or two, by its status."""


def unusable(status: int, tick: int, quaternion: Array) -> UnusableStateError:
    """Return the error to raise for a state of a ``status`` other than `USABLE`."""
    if status == SINGULAR:
        return SingularAttitudeError(tick)
    why = "the state is not finite"
    if status == NOT_UNIT:
        why = f"the base's quaternion has norm {norm(quaternion):.6g}, not 1"
    elif status == TOO_LARGE:
        why = f"the state has a number beyond {LARGEST:g}"
    return UnusableStateError(tick, why, STATUS_WORDS[status])
