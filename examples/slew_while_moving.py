"""A turn of the base by 30 degrees while the arm moves, under each of the five laws.

The reference of attitude and joints is consistent in position, rate and acceleration, so the error
of the attitude during the turn is that of the law. Friction is on, as in case 1: it is what the
laws that compute the torque do not know.

    python examples/slew_while_moving.py

prints:

    ctc      attitude error at most 0.0033 arcsec
    ctc_smc  attitude error at most 0.1918 arcsec
    tde_smc  attitude error at most 0.0097 arcsec
    tde_tsmc attitude error at most 0.0000 arcsec
    tde_stc  attitude error at most 0.0019 arcsec
"""

from __future__ import annotations

from space_robot import Scenario

LAWS = ("ctc", "ctc_smc", "tde_smc", "tde_tsmc", "tde_stc")
MISSION = {
    "start": {"joints_deg": [0, 120, 220, 0, -10, 0]},
    "segments": [
        {"base": {"rpy_deg": [0, 0, 30]}, "joints_deg": [15, 110, 185, 45, 10, -25], "duration": 30}
    ],
}


def main() -> None:
    """Fly the turn under each law."""
    for law in LAWS:
        metrics = Scenario(controller=law, mission=MISSION, case="1").fly().metrics
        arcsec = metrics["base_rotation.max"]
        print(f"{law:8} attitude error at most {arcsec:.4f} arcsec")


if __name__ == "__main__":
    main()
