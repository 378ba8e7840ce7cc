"""A campaign: many flights with uncertain parameters, and verdicts with a confidence.

Masses are wrong by up to 20 %, sensors are `fine`, and the navigation is filtered. Two laws fly
the same draws. The requirement: the quaternion's error stays below 2e-5 (8 arcsec) in 80 % of all
such cases, at 90 % confidence. Eleven runs, fixed in advance, are the smallest number that can
show it: if the share were 80 %, all eleven would meet the limit with a probability of 0.8^11,
8.6 %. A verdict is valid only for the parameters and distributions of the campaign, here also only
for the first second of case 3.

    python examples/small_campaign.py

prints:

    tde_stc=robust: 11 of 11 runs, so 81 % to 100 % of all: met
    ctc: 4 of 11 runs, so 17 % to 60 % of all: not met
    worst: run 5 under ctc, 3.6e-05; flown again to the same bits: True
"""

from __future__ import annotations

from space_robot import Campaign

STUDY = {
    "scenario": {"case": "3", "sensors": "fine", "navigation": "filtered", "duration": 1.0},
    "laws": ["tde_stc=robust", "ctc"],
    "vary": {
        "robot.links[*].mass": {"uniform": [0.8, 1.2], "relative": True},
        "robot.base.mass": {"uniform": [0.8, 1.2], "relative": True},
    },
    "fixed_runs": True,
    "require": {"pointing": {"metric": "attitude.max", "below": 2e-5, "in": 0.8}},
}


def main() -> None:
    """Fly the campaign, print its verdicts, and repeat its worst case."""
    flown = Campaign.of(STUDY).run(runs=11, seed=7, workers=0)
    for verdict in flown.verdicts:
        met = verdict.runs - verdict.failures
        print(
            f"{verdict.law}: {met} of {verdict.runs} runs, so {100 * verdict.limits.low:.0f} % "
            f"to {100 * verdict.limits.high:.0f} % of all: {verdict.word}"
        )
    table = flown.table
    worst = table.loc[table["require.pointing"].idxmax()]
    again = flown.rerun(int(worst["run"]), worst["law"])
    print(
        f"worst: run {worst['run']} under {worst['law']}, {worst['require.pointing']:.1e}; "
        f"flown again to the same bits: {again.is_same}"
    )


if __name__ == "__main__":
    main()
