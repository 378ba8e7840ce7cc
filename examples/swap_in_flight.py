"""A change of the law in flight, on the real graph of ROS 2 nodes.

`space-robot fly` starts plant, controller, mission and recorder (here in one process), and the
controller changes from TDE-STC to CTC between two ticks. The new law starts from the applied
torque, and blends to its own within 20 ms, so the torque has no step.
In a flight of your own, ``ros2 param set /controller_node controller ctc`` does the same.

    python examples/swap_in_flight.py

prints, from the bag:

    tde_stc from 0.0000 s on
    ctc from 1.0000 s on
    largest step of a torque at the swap: 4.4e-12 N m, in the 20 ms after it: 5.3e-03 N m
    attitude error at the swap 1.4e-06 deg, at the end 7.7e-07 deg
"""

from __future__ import annotations

import argparse
import subprocess
from pathlib import Path

import numpy as np

from space_robot import load_bag
from space_robot.analysis import attitude_angles


def main(bag: Path) -> None:
    """Fly, then read the effects of the swap from the bag."""
    options = ["--composed", "--swap", "1:ctc", "--duration", "2", "--bag", str(bag)]
    subprocess.run(["space-robot", "fly", *options], check=True, capture_output=True)
    log = load_bag(bag)
    for law in log.laws:
        print(f"{law.name} from {log.time[law.tick]:.4f} s on")
    swap = log.laws[1].tick
    steps = np.abs(np.diff(log.applied_torque, axis=0)).max(axis=1)
    print(
        f"largest step of a torque at the swap: {steps[swap]:.1e} N m, "
        f"in the 20 ms after it: {steps[swap + 1 : swap + 41].max():.1e} N m"
    )
    error = np.linalg.norm(attitude_angles(log), axis=1)
    print(f"attitude error at the swap {error[swap]:.1e} deg, at the end {error[-1]:.1e} deg")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Swap the law of a ROS graph in flight.")
    arguments.add_argument("--bag", type=Path, default=Path("flights/swapped"))
    main(arguments.parse_args().bag)
