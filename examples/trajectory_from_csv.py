"""A trajectory of your own, from a CSV file: a wave of one joint, resampled to the ticks.

A cubic spline goes through all rows, with continuous acceleration, and begins and ends at rest. The
numbers become part of the flight's description: a bag flies again without the file.

    python examples/trajectory_from_csv.py

prints:

    81 rows from 0 to 8 s, flown in 16000 ticks
    joint2 from 102.6 to 137.4 deg, RMS error 0.0383 mrad
"""

from __future__ import annotations

import csv
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

from space_robot import Scenario

FOLDED = np.radians([0.0, 120.0, 220.0, 0.0, -10.0, 0.0])
SWING = np.radians(20.0)


def write(file: Path) -> int:
    """Write the wave; return the number of rows."""
    times = np.linspace(0.0, 8.0, 81)
    with file.open("w", newline="") as stream:
        writer = csv.writer(stream)
        writer.writerow(["time", *(f"joint{k}" for k in range(1, 7))])
        for time in times:
            joints = FOLDED.copy()
            joints[1] += SWING * np.sin(np.pi * time / 8.0) ** 2 * np.sin(np.pi * time / 2.0)
            writer.writerow([f"{value:.9f}" for value in (time, *joints)])
    return len(times)


def main() -> None:
    """Write the file and fly it."""
    with TemporaryDirectory() as folder:
        file = Path(folder) / "wave.csv"
        rows = write(file)
        start = {"joints_deg": np.degrees(FOLDED).tolist()}
        mission = {"start": start, "segments": [{"file": str(file)}]}
        flight = Scenario(controller="tde_tsmc", mission=mission).fly()
    print(f"{rows} rows from 0 to 8 s, flown in {flight.log.ticks} ticks")
    joint = np.degrees(flight.log.joint_positions[:, 1])
    rms = 1e3 * flight.metrics["joints_1_3.rms"]
    print(f"joint2 from {joint.min():.1f} to {joint.max():.1f} deg, RMS error {rms:.4f} mrad")


if __name__ == "__main__":
    main()
