"""A fault on the real graph of ROS 2 nodes: the link is interrupted for 0.3 s.

No state reaches the controller, so it sends no command. For 0.1 s (``hold_ticks``) the plant
holds the last valid command; then it is in safe mode, with zero torque. Meanwhile arm and base
keep their momentum, and friction slows the joints down, so the tracking error grows. With the
first state after the gap the law starts again, from the torque that is applied at that time.

    python examples/fault.py

prints, from the bag:

    600 of 4000 ticks without a command, no torque from 1.1005 s to 1.3005 s
    attitude off before 1.4e-06 deg, at worst 4.2e-04 deg
    joints off before 3.0e-06 deg, at worst 0.099 deg, at the end 0.081 deg
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import numpy as np

from space_robot import load_bag
from space_robot.analysis import attitude_angles

BEGIN_S, END_S = 1.0, 1.3


def main(bag: Path) -> None:
    """Fly, then read the effects of the fault from the bag."""
    options = ["--composed", "--fault", f"drop_state@{BEGIN_S}-{END_S}:1", "--duration", "2"]
    command = ["space-robot", "fly", *options, "--bag", str(bag)]
    subprocess.run(command, check=True, capture_output=True)
    log = load_bag(bag)
    is_safe = (log.applied_torque == 0.0).all(axis=1) & (log.time > BEGIN_S)
    safe_s = log.time[is_safe]
    print(
        f"{log.unanswered} of {log.ticks} ticks without a command, "
        f"no torque from {safe_s[0]:.4f} s to {safe_s[-1]:.4f} s"
    )
    attitude = np.linalg.norm(attitude_angles(log), axis=1)
    joints_deg = np.degrees(np.abs(log.reference_joints[:, 0] - log.joint_positions)).max(axis=1)
    before = int(np.searchsorted(log.time, BEGIN_S))
    print(f"attitude off before {attitude[before]:.1e} deg, at worst {attitude.max():.1e} deg")
    print(
        f"joints off before {joints_deg[before]:.1e} deg, at worst {joints_deg.max():.3f} deg, "
        f"at the end {joints_deg[-1]:.3f} deg"
    )


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Interrupt the link of a ROS graph for 0.3 s.")
    arguments.add_argument("--bag", type=Path, default=Path("flights/cut"))
    main(arguments.parse_args().bag)
