"""The controller: measured state and reference in, torque out, every tick. Knows no ROS."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled import kernel
from space_robot_msgs_py.errors import SingularAttitudeError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.attitude import SINGULAR_ETA, attitude_jacobian_inverse
from space_robot_sim.dynamics import Model
from space_robot_sim.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_sim.records import Record, assign, nested, shaped
from space_robot_sim.robot import Robot

from .laws import ControlLaw, Signals
from .time_delay_estimation import TimeDelayPair, observe, time_delay_estimate
from .tracking import force_from_torque, measured_rate, torque_from_force, tracking_errors

Array = NDArray[np.float64]
Block = NDArray[Any]


class ControllerMemory(Record):
    """What the controller knows and remembers, apart from its law."""

    model: Model = nested(Model)
    """The nominal robot."""
    nominal: RhoSpaceModel = nested(RhoSpaceModel)
    pair: TimeDelayPair = nested(TimeDelayPair)
    quaternion: Array = shaped(lambda n: (4,))
    """The measured one or its negative: the same attitude, but rho must not jump."""
    rate: Array = shaped(lambda n: (n + 3,))
    """rhodot."""
    jacobian: Array = shaped(lambda n: (3, 3))
    """J0."""
    last_jacobian_inverse: Array = shaped(lambda n: (3, 3))
    """J0^-1 of the last tick."""
    desired_jacobian: Array = shaped(lambda n: (3, 3))
    """Scratch."""
    applied_force: Array = shaped(lambda n: (n + 3,))
    """F_S over the last interval."""
    error: Array = shaped(lambda n: (n + 3,))
    error_rate: Array = shaped(lambda n: (n + 3,))
    acceleration_desired: Array = shaped(lambda n: (n + 3,))
    n_hat: Array = shaped(lambda n: (n + 3,))
    """These four as in `Signals`."""


class Controller:
    """Runs one law on a robot's nominal model; the law can be swapped between ticks.

    The time-delay pair is kept whatever the law, so a swap to one that needs it is seamless.
    """

    def __init__(self, robot: Robot, law: ControlLaw, period: float) -> None:
        self.period = period
        self.block = ControllerMemory.block(robot.n)
        """The controller's `ControllerMemory`, for compiled loops."""
        memory: ControllerMemory = self.block[0]
        assign(memory, model=robot.model, last_jacobian_inverse=2.0 * np.eye(3))
        self._command = Command(-1, np.zeros(robot.n + 3))
        self._jacobian = memory.jacobian
        self.signals = Signals(
            error=memory.error,
            error_rate=memory.error_rate,
            acceleration_desired=memory.acceleration_desired,
            n_hat=memory.n_hat,
            inertia=memory.nominal.inertia,
            bias=memory.nominal.bias,
        )
        self.law = law

    @property
    def law(self) -> ControlLaw:
        """The law in force."""
        return self._law

    @law.setter
    def law(self, law: ControlLaw) -> None:
        law.reset()
        self.signals.n_hat[:] = 0.0
        self._law = law

    def update(self, state: RobotState, joints: Array, base: Array) -> Command:
        """The torque that answers a measured state.

        Args:
            state: the plant's measurements, with the torque it applied since the last tick.
            joints: (3, n) desired position, velocity, acceleration of the joints.
            base: (10,) desired quaternion, angular velocity, angular acceleration (base frame).

        Returns:
            The command for this tick, valid until the next call.

        Raises:
            SingularAttitudeError: the base has turned by 180 degrees.
        """
        law, command = self._law, self._command
        eta = sense(
            self.block, state.tick, state.quaternion, state.omega_base, state.joint_positions,
            state.joint_velocities, state.applied_torque, joints, base, law.h_bar, law.uses_model,
            self.period,
        )  # fmt: skip
        if not abs(eta) > SINGULAR_ETA:
            raise SingularAttitudeError(state.tick, eta)
        torque_from_force(self._jacobian, law.force(self.signals), command.torque)
        command.tick = state.tick
        return command

    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """s, u, N_hat and e of the last tick, (m,) each."""
        law = self._law
        return law.sliding_surface, law.pseudo_acceleration, self.signals.n_hat, self.signals.error


@kernel
def sense(
    block: Block, tick: int, quaternion: Array, omega_base: Array, joint_positions: Array,
    joint_velocities: Array, applied_torque: Array, joints: Array, base: Array, h_bar: Array,
    uses_model: bool, period: float,
) -> float:  # fmt: skip
    """`form_signals` for callers from Python."""
    eta: float = form_signals(
        block[0], tick, quaternion, omega_base, joint_positions, joint_velocities, applied_torque,
        joints, base, h_bar, uses_model, period,
    )  # fmt: skip
    return eta


@kernel
def form_signals(
    memory: ControllerMemory, tick: int, quaternion: Array, omega_base: Array,
    joint_positions: Array, joint_velocities: Array, applied_torque: Array, joints: Array,
    base: Array, h_bar: Array, uses_model: bool, period: float,
) -> float:  # fmt: skip
    """Turn a measured state and a reference row into the law's signals.

    ``h_bar`` is empty for a law without time-delay estimate.

    Returns:
        eta; where it is singular (or NaN) nothing was done.
    """
    near, rate, dot = memory.quaternion, memory.rate, 0.0
    for k in range(4):
        dot += quaternion[k] * near[k]
    side = -1.0 if dot < 0.0 else 1.0
    eta: float = side * quaternion[0]
    if not abs(eta) > SINGULAR_ETA:
        return eta
    for k in range(4):
        near[k] = side * quaternion[k]
    measured_rate(near, omega_base, joint_velocities, memory.jacobian, rate)
    # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
    force_from_torque(memory.last_jacobian_inverse, applied_torque, memory.applied_force)
    attitude_jacobian_inverse(near, memory.last_jacobian_inverse)
    observe(memory.pair, tick, memory.applied_force, rate, period)
    tracking_errors(
        near, joint_positions, rate, joints, base, memory.desired_jacobian,
        memory.error, memory.error_rate, memory.acceleration_desired,
    )  # fmt: skip
    if h_bar.size > 0:
        time_delay_estimate(memory.pair, h_bar, memory.n_hat)
    if uses_model:
        rho_space_into(
            memory.model, near, joint_positions, omega_base, joint_velocities, memory.nominal
        )
    return eta
