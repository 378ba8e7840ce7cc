"""Your own robot: from a URDF to a flight, with its own mission and gains.

`two_link_arm.urdf` is a satellite of 200 kg with a light arm of three joints. Mission and gains
exist for the shipped robots only, so this program defines them. Computed torque uses the robot's
model, so it needs only two gains: every axis is critically damped at 10 rad/s.
``space-robot new two_link_arm.urdf`` creates a mission and gains for all laws instead.

    python examples/own_robot.py

prints:

    two_link_arm: base of 200 kg, arm of 14 kg: yaw, pitch, elbow
    joints at most 1.4e-07 rad off, the tool 1.3e-07 m
    base torque at most 0.460 N m; left alone, the base would turn by 8.16 deg
"""

from __future__ import annotations

from pathlib import Path

import numpy as np

from space_robot import Robot, Scenario

URDF = Path(__file__).with_name("two_link_arm.urdf")


def main() -> None:
    """Read the robot and fly it with a controlled and with a free base."""
    robot = Robot.from_urdf(URDF)
    print(
        f"{robot.name}: base of {robot.mass[0]:g} kg, arm of {robot.mass[1:].sum():g} kg: "
        f"{', '.join(robot.joint_names)}"
    )
    scenario = Scenario(
        robot=robot,
        mission={
            "start": {"joints_deg": [0, 0, 0]},
            "segments": [{"joints_deg": [40, -30, 60], "duration": 10}],
        },
        controller="ctc",
        gains={"k_p": 100.0, "k_d": 20.0},
        friction=False,
    )
    held = scenario.fly().check()
    joints, tool = held.metrics["joints_1_3.max"], held.metrics["tool_position.max"]
    print(f"joints at most {joints:.1e} rad off, the tool {tool:.1e} m")
    free = scenario.replace(actuators="none").fly().check()
    print(
        f"base torque at most {held.metrics['base_torque.max']:.3f} N m; left alone, the base "
        f"would turn by {np.degrees(free.metrics['attitude_drift.max']):.2f} deg"
    )


if __name__ == "__main__":
    main()
