"""Replay: a bag as the regression test of a controller.

A bag contains the controller's inputs and its commands. `replay` gives a controller the recorded
messages again, and compares every command to the last bit. Record once with
software that you trust; after a change of code, assert `has_passed` in a test. Here a different
gain represents the change: the second replay reports the first tick that differs.

    python examples/replay_regression.py

prints:

    unchanged: 1000 of 1000 commands equal to the last bit, passed: True
    k_1 of 0.2: 1 of 1000 commands equal to the last bit, passed: False
    first difference at t = 0.0005 s
"""

from __future__ import annotations

import argparse
from pathlib import Path

from space_robot import Scenario, replay


def main(bag: Path) -> None:
    """Record half a second and replay it twice."""
    if not bag.exists():
        Scenario(controller="tde_stc", duration=0.5).fly(bag=bag)
    for title, parameters in (("unchanged", {}), ("k_1 of 0.2", {"tde_stc.k_1": [0.2]})):
        played = replay(bag, parameters=parameters)
        report = played.report()
        print(
            f"{title}: {report['equal']} of {report['compared']} commands equal to the last bit, "
            f"passed: {played.has_passed}"
        )
    print(f"first difference at t = {report['first_difference']['time_s']:.4f} s")


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Replay a bag.")
    arguments.add_argument("--bag", type=Path, default=Path("flights/trusted"))
    main(arguments.parse_args().bag)
