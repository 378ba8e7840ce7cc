"""A law of your own that looks at the tool: transposed-Jacobian control of its position.

Laws see more than errors: time, state, reference, nominal model, and pose and Jacobians of a tool.
Here a spring and a damper pull the tool to the place that the reference's joints give it; they act
on the joints through the transposed Jacobian (Hogan, Impedance control, 1985), and a weak PD
controller holds the rest. The nominal model cancels the reaction on the base.

    python examples/tool_law.py

prints the largest errors in 5 s of case 1, beside a PD controller with the same weak gains:

    joints alone: tool 107.6 mm, attitude 1.9e-02 deg, joints 4-6 0.023 rad
    tool law:     tool   0.7 mm, attitude 8.7e-04 deg, joints 4-6 0.031 rad
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot import Scenario
from space_robot_control.laws import Signals
from space_robot_model.robot.kinematics import tool_state

Array = NDArray[np.float64]

STIFFNESS, DAMPING = 2000.0, 400.0
"""Of the tool, N/m and N s/m."""
WEAK_P = np.array([2e4, 2e4, 2e4, 100.0, 100.0, 100.0, 10.0, 10.0, 10.0])
"""K_P of base and joints, N m/rad."""
WEAK_D = np.array([1e4, 1e4, 1e4, 50.0, 50.0, 50.0, 5.0, 5.0, 5.0])
"""K_D of the same, N m s/rad."""


def joints_alone(signals: Signals) -> Array:
    """Return ``F = K_P e + K_D edot``."""
    return WEAK_P * signals.error + WEAK_D * signals.error_rate


def tool_law(signals: Signals) -> Array:
    """Return the same with ``J^T (K (x_d - x) + D (xdot_d - xdot))`` on the joints."""
    force, desired, tool = joints_alone(signals), signals.reference, signals.tool_state()
    place = tool_state(signals.robot, desired.quaternion, desired.joint_positions)
    pull = STIFFNESS * (place.position - tool.position)
    pull += DAMPING * (tool.held[:3] @ signals.error_rate[3:])
    force[3:] += tool.held[:3].T @ pull
    model = signals.nominal
    joints = np.linalg.solve(model.inertia[3:, 3:], force[3:] - model.bias[3:])
    force[:3] += model.inertia[:3, 3:] @ joints + model.bias[:3]
    return force


def main() -> None:
    """Fly both laws and print their errors."""
    for title, law in (("joints alone:", joints_alone), ("tool law:", tool_law)):
        flight = Scenario(case="1", duration=5.0, controller=law).fly()
        metrics = flight.metrics
        print(
            f"{title:13} tool {1e3 * metrics['tool.max']:5.1f} mm, "
            f"attitude {metrics['attitude_angle.max']:.1e} deg, "
            f"joints 4-6 {metrics['joints_4_6.max']:.3f} rad"
        )


if __name__ == "__main__":
    main()
