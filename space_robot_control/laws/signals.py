"""What a control law may know at a tick."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_model.dynamics.model import Model
from space_robot_model.dynamics.rho_space import RhoSpaceModel
from space_robot_model.robot import Robot
from space_robot_model.robot.kinematics import ToolState, tool_state
from space_robot_msgs_py.compiled.records import Record, RecordView, nested, shaped
from space_robot_msgs_py.samples import Reference

Array = NDArray[np.float64]


def per_axis(description: str, unit: str = "") -> Any:
    """Declare a gain, or a field of a law's memory, with one value per axis: (m,)."""
    return shaped(lambda n: (n + 3,), ", ".join(filter(None, (description, unit))))


class SignalsView(RecordView):
    """Signals for laws in Python: the fields, and what is computed on demand."""

    robot: Robot
    """The robot as the controller knows it, without payload."""

    def tool_state(self, tool: str | None = None) -> ToolState:
        """Return pose and Jacobians of a tool of the nominal robot; see `Signals.tool_state`."""
        signals: Any = self
        return tool_state(self.robot, signals.quaternion, signals.joint_positions, tool)


class Signals(Record):
    """Inputs of a law at a tick, in the coordinates ``rho = [eps_e, theta]``, m = n+3 axes.

    eps_e is the vector part of ``attitude_error``; it is desired to be zero.
    The state is the one that flight software knows: measured, or estimated by navigation. For a
    base without attitude actuators all signals of m axes are zero on the base's.
    """

    view_type = SignalsView

    error: Array = per_axis("e = rho_d - rho")
    error_rate: Array = per_axis("edot")
    acceleration_desired: Array = per_axis("rhodd_d")
    n_hat: Array = per_axis("time-delay estimate N_hat of (35), (36)", "N m")
    """Zero for laws without time-delay estimate."""
    tick: float = shaped(lambda n: (), "number of the tick")
    time: float = shaped(lambda n: (), "simulated time, s")
    quaternion: Array = shaped(lambda n: (4,), "base attitude [w, x, y, z], base to inertial frame")
    """As measured or estimated, of either sign."""
    attitude_error: Array = shaped(
        lambda n: (4,), "q_e = q_d* q [w, x, y, z], base to desired frame; free base: to inertial"
    )
    """The sign is the one for which rho is continuous."""
    omega_base: Array = shaped(lambda n: (3,), "angular velocity in the base frame, rad/s")
    joint_positions: Array = shaped(lambda n: (n,), "rad, or m for prismatic joints")
    joint_velocities: Array = shaped(lambda n: (n,), "rad/s, or m/s")
    rho: Array = per_axis("rho = [eps_e, theta]")
    rho_rate: Array = per_axis("rhodot")
    rho_step: Array = per_axis("step of rho since the last tick by one of the reference")
    """Zero while the base's reference goes on where it was; no torque causes it."""
    rate_step: Array = per_axis("step of rhodot by the same")
    applied_force: Array = per_axis("F_S applied over the last interval", "N m")
    paired_force: Array = per_axis("the same through the low-pass of the time-delay pair", "N m")
    paired_acceleration: Array = per_axis("mean rhodd of that interval, through the same low-pass")
    base_is_free: float = shaped(lambda n: (), "1 if nothing turns the base, else 0", uniform=True)
    reference: Reference = nested(Reference)
    """Desired motion of base and joints."""
    nominal: RhoSpaceModel = nested(RhoSpaceModel)
    """``inertia`` (m, m) H_S and ``bias`` (m,) c_S; filled only for laws with ``uses_model``, and
    for a time-delay estimate with the nominal inertia.

    For a base without attitude actuators they are those of
    `space_robot_model.dynamics.free_floating`.
    """
    model: Model = nested(Model)
    """Numbers of the nominal robot for the algorithms of `space_robot_model.dynamics`."""
    robot: Robot
    """The same robot; for laws in Python only."""

    def tool_state(self, tool: str | None = None) -> ToolState:
        """Return pose and Jacobians of a tool of the nominal robot; for laws in Python only.

        Args:
            tool: its name; None: the robot's first.

        Raises:
            InputError: the robot has no such tool.
        """
        raise NotImplementedError("signals in kernels have no robot")
