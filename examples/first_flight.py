"""First flight: why the attitude of a satellite must be controlled while its arm moves.

In space no ground absorbs the reaction of the arm: the base loses the angular momentum that the
arm gains. The paper's robot flies the same mission twice, with a free-floating base and with a
base that TDE-STC controls. The base's position is not controlled in either flight, so it drifts
in both.

    python examples/first_flight.py --out first_flight

prints the following, and draws the second flight:

    nothing turns the base: it turned by 8.01 deg and drifted by 0.131 m
    tde_stc holds the base: it turned by 3.92e-06 deg and drifted by 0.132 m
    to hold it took up to 2.66 N m, and wheels would have to take up 11.3 N m s
"""

from __future__ import annotations

import argparse

import numpy as np

from space_robot import FlownFlight, Scenario


def base_motion(flight: FlownFlight) -> str:
    """Return a text with the base's rotation and drift from its initial pose."""
    turned_deg = np.degrees(2.0 * np.arcsin(np.linalg.norm(flight.log.quaternion[:, 1:], axis=1)))
    drift_m = np.linalg.norm(flight.log.base_position - flight.log.base_position[0], axis=1)
    return f"it turned by {turned_deg.max():.3g} deg and drifted by {drift_m.max():.3f} m"


def main(out: str | None = None) -> None:
    """Fly twice and print the motion of the base."""
    free = Scenario(controller="tde_stc", case="1", actuators="none").fly()
    print(f"nothing turns the base: {base_motion(free)}")
    held = Scenario(controller="tde_stc", case="1").fly()
    print(f"tde_stc holds the base: {base_motion(held)}")
    torque_nm = held.metrics["base_torque.max"]
    momentum_nms = held.metrics["sizing.peak_momentum"]
    print(
        f"to hold it took up to {torque_nm:.2f} N m, "
        f"and wheels would have to take up {momentum_nms:.1f} N m s"
    )
    if out:
        held.plot("control_results", out)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Fly the paper's robot, base free and held.")
    arguments.add_argument("--out", help="path of the second flight's figure, without a suffix")
    main(arguments.parse_args().out)
