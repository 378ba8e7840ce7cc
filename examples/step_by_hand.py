"""Stepping by hand: your own loop around the plant, and two continuations of one snapshot.

The bench flies a scenario tick by tick with torques from any source. Here a PD law moves the
joints and no torque acts on the base, so the total angular momentum stays zero and the base turns
against the arm. `save` and `restore` compare two continuations from the same state: with the
motors on and with the motors off.

    python examples/step_by_hand.py

prints:

    after 4 s: base turned by 0.47 deg, joints at most 0.49 deg off
    motors on  for 2 s more: joints at most 0.16 deg off
    motors off for 2 s more: joints at most 4.42 deg off
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from space_robot import Bench, Scenario


def joint_pd(bench: Bench) -> NDArray[np.float64]:
    """Return a PD torque (m,) on the joints, N m, and none on the base."""
    state, want = bench.state, bench.reference
    error = want.joint_positions - state.joint_positions
    rate = want.joint_velocities - state.joint_velocities
    return np.concatenate((np.zeros(3), 400.0 * error + 80.0 * rate))


def joint_error_deg(bench: Bench) -> float:
    """Return the largest error of a joint, deg."""
    error = bench.reference.joint_positions - bench.state.joint_positions
    return float(np.degrees(np.abs(error)).max())


def main() -> None:
    """Fly 4 s, then 2 s more in two ways."""
    bench = Scenario(controller=None, duration=6.0).bench()
    bench.reset()
    while bench.time < 4.0:
        bench.step(joint_pd(bench))
    turned_deg = np.degrees(2.0 * np.arccos(bench.state.quaternion[0]))
    print(
        f"after 4 s: base turned by {turned_deg:.2f} deg, "
        f"joints at most {joint_error_deg(bench):.2f} deg off"
    )
    snapshot = bench.save()
    for title, scale in (("on ", 1.0), ("off", 0.0)):
        bench.restore(snapshot)
        while not bench.done:
            bench.step(scale * joint_pd(bench))
        print(f"motors {title} for 2 s more: joints at most {joint_error_deg(bench):.2f} deg off")


if __name__ == "__main__":
    main()
