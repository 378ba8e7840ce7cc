"""A model predictive law: where the base's torque is limited, a QP in each tick shares it out.

Over ten steps, of 5 ms growing to 0.3 s, errors obey ``e'' = a = rhodd_d - u`` (H_S, c_S held). The
sum of ``weight (W^4 e^2 + 2 W^2 edot^2 + a^2)`` over steps and axes becomes least, with torques
within limits, by DAQP: `pip install 'daqp>=0.8'`.

    python examples/mpc_law.py

prints the RMS errors in 5 s of case 1, with at most 0.7 N m on each axis of the base:

    ctc:                 attitude 9.6e-03 deg, joints 1-3 2.5e-04 rad
    mpc, equal weights:  attitude 2.5e-03 deg, joints 1-3 6.3e-06 rad
    mpc, attitude first: attitude 8.1e-06 deg, joints 1-3 1.1e-04 rad
"""

from __future__ import annotations

from typing import Any

import daqp
import numpy as np
from numpy.typing import NDArray

from space_robot import Scenario
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis


class Gains(LawGains):
    """Gains with one value for all axes, or one per axis: base x, y, z, then the joints."""

    weight, torque_limit = per_axis("cost of errors"), per_axis("largest torque", "N m")


class ModelPredictiveControl(ControlLaw):
    """``F_S = H_S u + c_S`` with the u of the first of N steps."""

    name, gains_type, uses_model = "mpc", Gains, True
    bandwidth, steps = 100.0, 5e-3 * 1.6 ** np.arange(10)  # W rad/s; (N,) s

    def reset(self) -> None:
        """Set gains (N, 2) of u without limits; adding ``root @ z`` to it then costs |z|^2 / 2."""
        w, h, t, one = self.bandwidth, self.steps, np.cumsum(self.steps), np.ones_like(self.steps)
        edot = np.tril(np.outer(one, h))  # after each step, by the a of each
        x = np.array([edot * (t[:, None] - t + h / 2.0), edot])  # (2, N, N)
        cost = h[:, None, None] * np.diag([w**4, 2.0 * w**2])
        cost[-1] = [[2.0 * w**3, w**2], [w**2, 2.0 * w]]  # of all that follows
        weighed = np.einsum("akj,kab->bkj", x, cost)
        hessian = np.diag(h) + np.einsum("akj,akl->jl", weighed, x)
        unforced = np.array([[one, t], [0.0 * one, one]])  # after each step, from e and edot
        self.gain = np.linalg.solve(hessian, np.einsum("akj,ack->jc", weighed, unforced))
        self.root = np.linalg.inv(np.linalg.cholesky(hessian)).T
        self.solver: Any = None
        super().reset()

    def __getstate__(self) -> dict[str, Any]:
        """Leave the solver out, which cannot be copied."""
        return super().__getstate__() | {"solver": None}

    def force(self, signals: Signals) -> NDArray[np.float64]:
        """Return the generalised force F_S (m,), N m."""
        x, model, force = signals, signals.nominal, np.asarray(self.memory.force)
        mass, bias = model.inertia.copy(), model.bias.copy()
        to_torque = np.linalg.solve(model.to_force.T, model.rotation).T  # J0^T
        mass[:3], bias[:3] = to_torque @ mass[:3], to_torque @ bias[:3]
        u = x.acceleration_desired + self.gain @ np.array([x.error, x.error_rate])  # (N, m)
        torque, limit = u @ mass.T + bias, self.gains.torque_limit
        root = self.root[:, :, None] / np.sqrt(self.gains.weight)  # (N, N, m)
        by_z = (mass[:, None] * root[:, None]).reshape(torque.size, -1)  # torque of z, (N m, N m)
        bounds = by_z, (limit - torque).ravel(), (-limit - torque).ravel()
        if self.solver is None:
            self.solver = daqp.Model()
            self.solver.setup(np.eye(torque.size), np.zeros(torque.size), *bounds)
        else:  # begins with the limits that were active
            self.solver.update(None, None, *bounds)
        z, _, status, _ = self.solver.solve()
        if status < 1:
            raise ArithmeticError(f"DAQP found no solution: {status}")
        self.memory.u[:] = u[0] + (root[0] * z.reshape(u.shape)).sum(axis=0)
        force[:] = model.inertia @ self.memory.u + model.bias
        return force


def main() -> None:
    """Fly and print the errors."""
    scenario = Scenario(case="1", duration=5.0, parameters={"plant": {"base_torque_limit": 0.7}})
    gains = {"weight": 1.0, "torque_limit": [0.7] * 3 + [1e3] * 6}
    mpc = scenario.replace(controller=ModelPredictiveControl, gains=gains)
    for title, flown in (
        ("ctc:", scenario.replace(controller="ctc", gains="tuned")),
        ("mpc, equal weights:", mpc),
        ("mpc, attitude first:", mpc.replace(gains={**gains, "weight": [1e4] * 3 + [1.0] * 6})),
    ):
        rms = flown.fly().metrics
        attitude, joints = rms["attitude_angle.rms"], rms["joints_1_3.rms"]
        print(f"{title:20} attitude {attitude:.1e} deg, joints 1-3 {joints:.1e} rad")


if __name__ == "__main__":
    main()
