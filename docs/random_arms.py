"""Random arms under constant and nominal inertia: `python docs/random_arms.py [--arms N]`.

Draws arms on bases, makes both gain sets of each by the method of `gains tune`, flies TDE-STC with
them and CTC beside it on plants whose masses and inertias are wrong by up to 20 %, and writes table
and figure of docs/explanation/nominal_inertia.md. Same number of arms, same bytes.
"""

from __future__ import annotations

import argparse
import itertools
import sys
from collections.abc import Iterator
from pathlib import Path
from typing import Any, NamedTuple

import matplotlib as mpl
import numpy as np

from space_robot import Scenario, fly_many
from space_robot.analysis.words import with_statistic
from space_robot.campaign.gain_set import tuned_set
from space_robot.tuning.method import Tuned, TuningOptions

sys.path.append(str(Path(__file__).parent / "flown"))
from marks import markdown, put

PAGE = Path(__file__).parent / "explanation" / "nominal_inertia.md"
FIGURE = Path(__file__).with_name("random_arms.png")
SEED = 20261126
WRONG = 0.2
"""Share by which each mass and inertia of the plant may be wrong."""
MARGIN = 0.05
DENSITY = 150.0
"""Of the bases, cubes, kg/m3: that of a small satellite."""
CASE, DURATION = "1", 40.0
LIMITS = (1e-6, 1e-5, 1e-4, 1e-3, 1e-2)
"""Errors between which flights are counted, rad."""
KINDS = ("ctc", "constant", "nominal")


class Arm(NamedTuple):
    """An arm with its gain sets and flights."""

    base: float
    """Mass of the base, kg."""
    arm: float
    """Mass of the arm, kg."""
    ratio: float
    """Largest over smallest eigenvalue of ``H_S^-1 h_bar``."""
    bandwidth: dict[str, float]
    """W of the laws with an estimate, rad/s."""
    errors: dict[str, float]
    """Largest RMS of attitude and joints, by law and kind of estimate; infinite if it diverged."""


def random_robot(rng: np.random.Generator) -> dict[str, Any]:
    """Return the content of a robot's file: 5 to 7 joints, slender links, a cube as base."""
    mass = float(f"{10 ** rng.uniform(1.5, 3.5):.4g}")
    side = (mass / DENSITY) ** (1.0 / 3.0)
    links = []
    for number in range(int(rng.integers(5, 8))):
        length, own = float(rng.uniform(0.2, 3.0)), float(10 ** rng.uniform(0.5, 2.0))
        across, along = own * length**2 / 12.0, own * 0.05**2
        links.append(
            {
                "name": f"joint{number + 1}",
                "alpha_deg": float(rng.choice([-90.0, 0.0, 90.0])) if number else 0.0,
                "a": links[-1]["com"][0] * 2.0 if links else 0.5 * side,
                "d": 0.0,
                "mass": float(f"{own:.4g}"),
                "inertia": [*(float(f"{i:.4g}") for i in (along, across, across)), 0.0, 0.0, 0.0],
                "com": [float(f"{0.5 * length:.4g}"), 0.0, 0.0],
            }
        )
    inertia = float(f"{mass * side**2 / 6.0:.4g}")
    base = {"mass": mass, "inertia": [inertia, inertia, inertia, 0.0, 0.0, 0.0]}
    return {"robot": {"name": "random_arm", "base": base, "links": links}}


def with_wrong_masses(rng: np.random.Generator, content: dict[str, Any]) -> dict[str, Any]:
    """Return the robot with each mass, and each inertia, off by up to `WRONG`."""

    def wrong(body: dict[str, Any]) -> dict[str, Any]:
        of_mass, of_inertia = rng.uniform(1.0 - WRONG, 1.0 + WRONG, 2)
        inertia = [float(of_inertia * value) for value in body["inertia"]]
        return {**body, "mass": float(of_mass * body["mass"]), "inertia": inertia}

    robot = content["robot"]
    links = [wrong(link) for link in robot["links"]]
    return {"robot": {**robot, "base": wrong(robot["base"]), "links": links}}


def mission_of(joints: int) -> dict[str, Any]:
    """Return a mission's content: from rest to rest, 30 degrees and back beyond the start."""
    there = [30.0 * (-1.0) ** joint for joint in range(joints)]
    goals = there, [-0.5 * angle for angle in there]
    segments = [{"joints_deg": goal, "duration": 0.5 * DURATION} for goal in goals]
    limits = {"check_actuators": False}
    return {"start": {"joints_deg": [0.0] * joints}, "segments": segments, "limits": limits}


def made(number: int) -> tuple[list[Scenario], dict[str, Tuned]]:
    """Return the flights of an arm and its gain sets, by kind."""
    rng = np.random.default_rng([SEED, number])
    nominal = random_robot(rng)
    joints = len(nominal["robot"]["links"])
    shared = {"robot": nominal, "mission": mission_of(joints)}
    sets = {
        kind: tuned_set(shared, [CASE], TuningOptions(MARGIN, WRONG, h_bar=kind), lambda step: None)
        for kind in KINDS[1:]
    }
    plant, scenarios = with_wrong_masses(rng, nominal), []
    for kind in KINDS:
        law, own = ("ctc", sets["constant"]) if kind == "ctc" else ("tde_stc", sets[kind])
        gains = {name: values.tolist() for name, values in own.laws[law].gains.items()}
        corner = {"controller": {"acceleration_filter_hz": own.corner_hz}}
        scenarios.append(
            Scenario(
                **shared,
                plant_robot=plant,
                controller=law,
                gains=gains,
                parameters=corner,
                case=CASE,
                duration=DURATION,
            )
        )
    return scenarios, sets


def flown(count: int) -> Iterator[Arm]:
    """Fly ``count`` arms."""
    for number in range(count):
        scenarios, sets = made(number)
        errors = {}
        for kind, flight in zip(KINDS, fly_many(scenarios), strict=True):
            rms = with_statistic(flight.metrics, "rms")
            own = [rms[key] for key in rms if key == "attitude" or key.startswith("joints")]
            errors[kind] = max(own) if flight.ending.outcome == "complete" else np.inf
        robot = scenarios[0].robot["robot"]
        arm = sum(link["mass"] for link in robot["links"])
        constant = sets["constant"]
        yield Arm(
            robot["base"]["mass"],
            arm,
            constant.largest / constant.smallest,
            {kind: own.bandwidth for kind, own in sets.items()},
            errors,
        )
        print(f"{number + 1} of {count}", flush=True)


def table(arms: list[Arm]) -> str:
    """Return how many arms have which error."""
    edges = [0.0, *LIMITS, 1e300]
    titles = [f"below {LIMITS[0]:.0e}", *(f"to {x:.0e}" for x in LIMITS[1:]), "more", "diverged"]
    rows = []
    names = {"ctc": "CTC", "constant": "TDE-STC, constant", "nominal": "TDE-STC, nominal"}
    for kind in KINDS:
        errors = np.array([arm.errors[kind] for arm in arms])
        counts = [
            int(np.sum((low <= errors) & (errors < high)))
            for low, high in itertools.pairwise(edges)
        ]
        counts.append(int(np.sum(np.isinf(errors))))
        rows.append([names[kind], *map(str, counts), f"{np.median(errors):.1e}"])
    return markdown(("error, rad", *titles, "median"), rows).replace("e-0", "e-")


def draw(arms: list[Arm]) -> None:
    """Draw errors by the ratio of eigenvalues."""
    mpl.use("Agg")
    from matplotlib import pyplot as plt

    figure, axes = plt.subplots(figsize=(7.0, 4.0), layout="constrained")
    ratios = [arm.ratio for arm in arms]
    for kind, marker in zip(KINDS, "x.o", strict=True):
        errors = [min(arm.errors[kind], 1.0) for arm in arms]
        label = "CTC" if kind == "ctc" else f"TDE-STC, {kind} inertia"
        axes.loglog(ratios, errors, marker, label=label, fillstyle="none")
    axes.set_xlabel(r"largest / smallest eigenvalue of $H_S^{-1}\bar H$")
    axes.set_ylabel("largest RMS error, rad")
    axes.legend()
    axes.grid(alpha=0.3)
    figure.savefig(FIGURE, dpi=110)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--arms", type=int, default=100, metavar="N", help="number of arms")
    arms = list(flown(parser.parse_args().arms))
    draw(arms)
    PAGE.write_text(put(PAGE.read_text("utf-8"), "random_arms", table(arms)), "utf-8")


if __name__ == "__main__":
    main()
