"""Tables as campaigns have them, of made-up numbers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import pandas as pd

BINS = 100
SERIES = ("attitude", "base_torque")


def made_table(
    runs: int = 200,
    laws: Sequence[str] = ("ctc", "tde_stc", "tde_tsmc=robust"),
    seed: int = 1,
    failing: float = 0.01,
    grid: Sequence[str] = (),
    bands: bool = True,
) -> pd.DataFrame:
    """Make rows whose errors grow with the base's mass and with the scale of torque.

    Law number i is 1 + i / 2 times as bad as the first; ``failing``: the share that diverges;
    ``grid``: values of the variable ``scenario.sensors``, one after the other.
    """
    rng = np.random.default_rng(seed)
    mass, scale = rng.uniform(0.8, 1.2, runs), rng.uniform(0.98, 1.02, runs)
    moon = rng.uniform(size=runs)
    noise = rng.lognormal(0.0, 0.1, (runs, len(laws)))
    error = 1e-5 * mass[:, np.newaxis] ** 3 * (1.0 + 20.0 * np.abs(scale - 1.0))[:, np.newaxis]
    error = error * noise * (1.0 + 0.5 * np.arange(len(laws)))
    places = np.array([grid[run % len(grid)] for run in range(runs)]) if grid else None
    if places is not None:
        error *= (1.0 + np.arange(runs) % len(grid))[:, np.newaxis]
    failed = rng.uniform(size=(runs, len(laws))) < failing
    time = np.exp(-np.linspace(0.0, 3.0, BINS)).astype(np.float32)
    rows = []
    for run in range(runs):
        for number, law in enumerate(laws):
            bad, value = bool(failed[run, number]), float(error[run, number])
            row = {
                "run": run,
                "law": law,
                "outcome": "diverged" if bad else "complete",
                "reason": "the flight diverged at tick 812" if bad else "",
                "ended_at_s": 0.4 if bad else 5.0,
                "vary.robot.base.mass": mass[run],
                "vary.faults.torque_scale@0:all": scale[run],
                "vary.unused": moon[run],
            }
            if places is not None:
                row["vary.scenario.sensors"] = places[run]
            for name, factor in (
                ("attitude.rms", 1.0),
                ("attitude.max", 5.0),
                ("joints_1_3.rms", 2.0),
                ("base_torque.ripple", 3e3),
            ):
                row[f"metric.{name}"] = None if bad else factor * value
            row["require.pointing"] = None if bad else 2.0 * value
            if bands:
                for name in SERIES:
                    row[f"band.{name}"] = (value * time)[: 8 if bad else None]
            row["digest"] = "" if bad else f"{run:08x}{number:08x}"
            rows.append(row)
    table = pd.DataFrame(rows)
    numbers = [c for c in table if str(c).startswith(("metric.", "require."))]
    return table.astype(dict.fromkeys(numbers, float))
