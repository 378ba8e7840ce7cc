"""First flight: why a satellite with an arm must be steered while the arm moves.

There is no ground to take an arm's reaction: what the arm gains in angular momentum the base
loses. The paper's robot flies the same mission twice, with a base that nothing turns and with one
that TDE-STC holds. The base's position is left free both times, so it drifts both times.

    python examples/first_flight.py --out first_flight

prints, and draws the second flight:

    nothing turns the base: it turned by 8.01 deg and drifted by 0.131 m
    tde_stc holds the base: it turned by 3.92e-06 deg and drifted by 0.132 m
    to hold it took up to 2.40 N m, and wheels would have to take up 11.3 N m s
"""

from __future__ import annotations

import argparse

import numpy as np

from space_robot import FlownFlight, Scenario


def base_motion(flight: FlownFlight) -> str:
    """Say how far the base got from where it began."""
    turned_deg = np.degrees(2.0 * np.arcsin(np.linalg.norm(flight.log.quaternion[:, 1:], axis=1)))
    drift_m = np.linalg.norm(flight.log.base_position - flight.log.base_position[0], axis=1)
    return f"it turned by {turned_deg.max():.3g} deg and drifted by {drift_m.max():.3f} m"


def main(out: str | None = None) -> None:
    """Fly twice and print what the base did."""
    free = Scenario(controller="tde_stc", case="1", actuators="none").fly()
    print(f"nothing turns the base: {base_motion(free)}")
    held = Scenario(controller="tde_stc", case="1").fly()
    print(f"tde_stc holds the base: {base_motion(held)}")
    torque_nm = held.metrics["maxima"]["base_torque"]
    momentum_nms = held.metrics["sizing"]["peak_momentum_n_m_s"]
    print(
        f"to hold it took up to {torque_nm:.2f} N m, "
        f"and wheels would have to take up {momentum_nms:.1f} N m s"
    )
    if out:
        held.plot("control_results", out)


if __name__ == "__main__":
    arguments = argparse.ArgumentParser(description="Fly the paper's robot, base free and held.")
    arguments.add_argument("--out", help="where to draw the second flight, without an ending")
    main(arguments.parse_args().out)
