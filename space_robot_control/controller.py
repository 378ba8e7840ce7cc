"""The controller: measured state and reference in, torque out, every tick. Knows no ROS."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import SingularAttitudeError
from space_robot_msgs_py.samples import Command, RobotState
from space_robot_sim.attitude import SINGULAR_ETA, attitude_jacobian_inverse
from space_robot_sim.dynamics.rho_space import RhoSpaceModel, rho_space_into
from space_robot_sim.robot import Robot

from .laws import ControlLaw, Signals
from .time_delay_estimation import TimeDelayEstimator
from .tracking import force_from_torque, measured_rate, torque_from_force, tracking_errors

Array = NDArray[np.float64]


class Controller:
    """Runs one law on a robot's nominal model; the law can be swapped between ticks.

    The time-delay pair is kept whatever the law, so a swap to one that needs it is seamless.
    """

    def __init__(self, robot: Robot, law: ControlLaw, period: float) -> None:
        axes = robot.n + 3
        self._model = robot.model
        self._estimator = TimeDelayEstimator(axes, period)
        self._nominal = RhoSpaceModel.allocate(robot.n)
        self._quaternion = np.zeros(4)
        self._rate = np.zeros(axes)
        self._jacobian = np.zeros((3, 3))
        self._last_jacobian_inverse = 2.0 * np.eye(3)
        self._desired_jacobian = np.zeros((3, 3))
        self._applied_force = np.zeros(axes)
        self._command = Command(-1, np.zeros(axes))
        self.signals = Signals(
            error=np.zeros(axes),
            error_rate=np.zeros(axes),
            acceleration_desired=np.zeros(axes),
            n_hat=np.zeros(axes),
            inertia=self._nominal.inertia,
            bias=self._nominal.bias,
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
        quaternion = self._quaternion
        if float(state.quaternion @ quaternion) < 0.0:
            # the same attitude from the other side: rho and its rates must not jump
            np.negative(state.quaternion, out=quaternion)
        else:
            quaternion[:] = state.quaternion
        eta = float(quaternion[0])
        if not abs(eta) > SINGULAR_ETA:
            raise SingularAttitudeError(state.tick, eta)
        measured_rate(
            quaternion, state.omega_base, state.joint_velocities, self._jacobian, self._rate
        )
        # the applied torque acted from the last tick on, so that tick's J0 turns it into F_S
        force_from_torque(self._last_jacobian_inverse, state.applied_torque, self._applied_force)
        attitude_jacobian_inverse(quaternion, self._last_jacobian_inverse)
        self._estimator.observe(state.tick, self._applied_force, self._rate)
        signals, law = self.signals, self._law
        tracking_errors(
            quaternion, state.joint_positions, self._rate, joints, base,
            self._desired_jacobian, signals.error, signals.error_rate,
            signals.acceleration_desired,
        )  # fmt: skip
        if law.uses_time_delay_estimate():
            signals.n_hat = self._estimator.estimate(law.gains["h_bar"])
        if law.uses_model:
            rho_space_into(
                self._model, quaternion, state.joint_positions, state.omega_base,
                state.joint_velocities, self._nominal,
            )  # fmt: skip
        command = self._command
        torque_from_force(self._jacobian, law.force(signals), command.torque)
        command.tick = state.tick
        return command

    def telemetry(self) -> tuple[Array, Array, Array, Array]:
        """s, u, N_hat and e of the last tick, (m,) each."""
        law = self._law
        return law.sliding_surface, law.pseudo_acceleration, self.signals.n_hat, self.signals.error
