"""Your own law: one class that is written like its equation, compared with a shipped law.

Time-delay control (37) has 20 lines. N_hat is the part of the last tick's torque that
``H_bar rhodd`` does not explain; the law assumes that it has not changed, and adds it. The law
needs no model of the robot, only a constant inertia per axis. TDE-STC has super-twisting terms
in place of K_P and K_D.

    python examples/own_law.py

prints the largest errors in 5 s of case 1 with friction:

    tde:     attitude 1.4e-05 deg, joints 1-3 1.7e-06 rad
    tde_stc: attitude 3.9e-06 deg, joints 1-3 5.4e-08 rad
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot import Scenario
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis


class Gains(LawGains):
    """Gains with one value for all axes, or one per axis: base x, y, z, then the joints."""

    h_bar = per_axis("constant inertia", "kg m2")
    k_p = per_axis("K_P", "1/s2")
    k_d = per_axis("K_D", "1/s")


class TimeDelayControl(ControlLaw):
    """Time-delay control, (37): ``F_S = H_bar (rhodd_d + K_D edot + K_P e) + N_hat``."""

    name = "tde"
    gains_type = Gains

    def force(self, signals: Signals) -> NDArray[np.float64]:
        """Return the generalised force F_S (m,), N m."""
        gains, x, u = self.gains, signals, self.memory.u
        u[:] = x.acceleration_desired + gains.k_d * x.error_rate + gains.k_p * x.error
        force: NDArray[np.float64] = gains.h_bar * u + x.n_hat
        return force


def main() -> None:
    """Fly both laws and print their errors."""
    gains = {"h_bar": [50.0] * 3 + [5.0] * 3 + [0.5] * 3, "k_p": 100.0, "k_d": 20.0}
    scenario = Scenario(case="1", duration=5.0)
    for title, flight in (
        ("tde:", scenario.replace(controller=TimeDelayControl, gains=gains).fly()),
        ("tde_stc:", scenario.replace(controller="tde_stc").fly()),
    ):
        attitude = flight.metrics["attitude_angle.max"]
        joints = flight.metrics["joints_1_3.max"]
        print(f"{title:8} attitude {attitude:.1e} deg, joints 1-3 {joints:.1e} rad")


if __name__ == "__main__":
    main()
