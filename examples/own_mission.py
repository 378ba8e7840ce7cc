"""Your own mission: the same motion at two speeds, and how speed affects the base.

A segment from rest to rest follows a fifth-order polynomial. In half the time the velocities are
twice as high and the accelerations four times. So are the torques, because inertial forces are
proportional to accelerations and to squares of velocities. The momentum that the base has to store
is proportional to velocities, and doubles. Friction does not scale in this way, and is switched
off.

    python examples/own_mission.py

prints:

    20 s: base torque  3.03 N m, momentum 14.0 N m s
    10 s: base torque 12.12 N m, momentum 28.1 N m s
    in half the time: torque x 3.99, momentum x 2.00
"""

from __future__ import annotations

from space_robot import FlownFlight, Scenario

FOLDED = [0.0, 120.0, 220.0, 0.0, -10.0, 0.0]
REACHED_OUT = [30.0, 100.0, 150.0, 90.0, 30.0, -50.0]
"""Angles of the paper's six joints, deg."""


def fly_in(seconds: float) -> FlownFlight:
    """Fly from one posture to the other in the specified time."""
    segment = {"joints_deg": REACHED_OUT, "duration": seconds}
    mission = {"start": {"joints_deg": FOLDED}, "segments": [segment]}
    return Scenario(mission=mission, friction=False).fly().check()


def main() -> None:
    """Fly the motion twice and compare the demands on the base."""
    torques, momenta = [], []
    for seconds in (20.0, 10.0):
        flight = fly_in(seconds)
        torques.append(flight.metrics["base_torque.max"])
        momenta.append(flight.metrics["sizing.peak_momentum"])
        print(
            f"{seconds:.0f} s: base torque {torques[-1]:5.2f} N m, "
            f"momentum {momenta[-1]:4.1f} N m s"
        )
    print(
        f"in half the time: torque x {torques[1] / torques[0]:.2f}, "
        f"momentum x {momenta[1] / momenta[0]:.2f}"
    )


if __name__ == "__main__":
    main()
