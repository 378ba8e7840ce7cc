"""Two arms on one satellite in MuJoCo, whose model is written down here once more by hand."""

from __future__ import annotations

import mujoco
import numpy as np

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate

PERIOD = 5e-4
ARM = """
<body pos="0.7 {y} 0">
  <joint axis="0 0 1"/><inertial pos="0 0 0.04" mass="6" diaginertia="0.05 0.05 0.03"/>
  <body pos="0.12 0 0">
    <joint axis="0 1 0"/><inertial pos="0.4 0 0" mass="8" diaginertia="0.03 0.56 0.56"/>
    <body pos="0.9 0 0">
      <joint axis="0 1 0"/><inertial pos="0.36 0 0" mass="6" diaginertia="0.02 0.33 0.33"/>
      <body pos="0.8 0 0">
        <joint axis="1 0 0"/><inertial pos="0.1 -0.02 0" mass="3" diaginertia="0.02 0.03 0.03"/>
      </body>
    </body>
  </body>
</body>"""
MODEL = f"""
<mujoco><option gravity="0 0 0" integrator="RK4" timestep="{PERIOD}"/><worldbody>
  <body name="base"><freejoint/>
    <inertial pos="0 0 0" mass="500" diaginertia="120 142 142"/>
    {ARM.format(y=0.45)}{ARM.format(y=-0.45)}
  </body>
</worldbody></mujoco>"""
"""`config/robots/dual_arm.yaml`, all bodies on the axes of the base when the joints are at zero."""


def test_they_move_as_in_mujoco_for_ten_seconds() -> None:
    """The first 10 s of its mission under CTC, its base left to itself: the same torques in both.

    Both integrate by Runge and Kutta's fourth order; they agree to rounding.
    """
    plan = FlightPlan(
        robot="dual_arm", controller="ctc", actuators="none", friction=False, duration=10.0
    )
    log = simulate(Flight(resolve(plan)))
    assert log.commanded_torque is not None
    model = mujoco.MjModel.from_xml_string(MODEL)
    data = mujoco.MjData(model)
    data.qpos[7:] = log.joint_positions[0]
    largest = dict.fromkeys(("joints", "joint rates", "attitude", "place"), 0.0)
    for tick in range(log.ticks):
        found = (
            log.joint_positions[tick] - data.qpos[7:],
            log.joint_velocities[tick] - data.qvel[6:],
            log.quaternion[tick] - data.qpos[3:7],
            log.base_position[tick] - data.qpos[:3],
        )
        for name, difference in zip(largest, found, strict=True):
            largest[name] = max(largest[name], float(np.abs(difference).max()))
        data.qfrc_applied[6:] = log.commanded_torque[tick, 3:]
        mujoco.mj_step(model, data)
    moved = np.abs(log.joint_positions[-1] - log.joint_positions[0])
    assert moved.min() > 0.4, "all joints move"
    turned = 2.0 * np.linalg.norm(log.quaternion[-1, 1:])
    assert turned > 0.05, "the base turns"
    assert max(largest.values()) < 1e-13, largest
