"""A flight as a pandas table: work and friction in each segment of the mission.

`FlownFlight.table` (for a bag: `space_robot.analysis.export.dataframe(load_bag(...))`) has one
row per tick, and units in the names of its columns. The paper's mission has two segments of 15 s
from rest to rest, so at the end of each all work of the motors has been dissipated by friction.
Joint 2's motor absorbs energy: the other motors drive that joint through the arm, and its motor
brakes it. This is dynamic coupling.

    python examples/pandas_analysis.py

prints:

    work of the motors, J
         joint1  joint2  joint3  joint4  joint5  joint6    all  friction
    leg
    1     0.020  -0.038   0.059   0.021   0.005   0.012  0.079     0.079
    2     0.006  -0.064   0.098   0.021   0.005   0.013  0.079     0.079
    base torque is largest, 2.66 N m, at 27.10 s
"""

from __future__ import annotations

import numpy as np
import pandas as pd

from space_robot import Scenario

COULOMB_NM, VISCOUS_NMS = 0.02, 0.2
"""Friction of every joint in case 1, N m and N m s/rad: `config/cases/1.yaml`."""


def main() -> None:
    """Fly case 1 and print the work of its motors."""
    flight = Scenario(controller="tde_stc", case="1").fly()
    joints, period_s = flight.log.joint_names, flight.flight.period
    table = flight.table.set_index("time_s")

    velocity = table[[f"{joint}_velocity_rad_s" for joint in joints]].set_axis(joints, axis=1)
    torque = table[[f"applied_torque_{joint}_n_m" for joint in joints]].set_axis(joints, axis=1)
    power_w = torque * velocity
    power_w["all"] = power_w.sum(axis=1)
    power_w["friction"] = (COULOMB_NM * velocity.abs() + VISCOUS_NMS * velocity**2).sum(axis=1)
    leg = pd.Series(np.where(table.index < 15.0, 1, 2), index=table.index, name="leg")
    work_j = (power_w * period_s).groupby(leg).sum()
    print("work of the motors, J")
    print(work_j.round(3).to_string())

    base_nm = np.sqrt((table.filter(like="applied_torque_base_") ** 2).sum(axis=1))
    print(f"base torque is largest, {base_nm.max():.2f} N m, at {base_nm.idxmax():.2f} s")


if __name__ == "__main__":
    main()
