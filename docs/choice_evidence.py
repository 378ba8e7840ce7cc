"""Does `choose` name the best law? `python docs/choice_evidence.py [ROBOT ...]`.

For shipped robots, and for arms on satellites whose URDF files are written here, the law is chosen
as `space-robot choose` does, with 80 gain sets a law and 12 draws; then every law that took part
flies 200 other draws with its best gains. Writes FOLDER/ROBOT.json for each robot (`--folder`), and
prints a table of all that are there. `--seed` is that of the search.
"""

from __future__ import annotations

import argparse
import json
import resource
import subprocess
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Xml

from space_robot import Scenario
from space_robot.choice import ChoiceOptions, recommend
from space_robot.choice.candidates import comparisons, fly_candidates, ranked
from space_robot.choice.criteria import CRITERIA
from space_robot.choice.recommend import candidates_study
from space_robot.processes.executor import cores

OTHER_SEED, DRAWS = 1000, 200
EVALUATIONS, RUNS = 80, 12
SENSED = {"sensors": "fine", "navigation": "filtered"}
SHIPPED: dict[str, dict[str, Any]] = {
    "paper": {"case": "3", "actuators": "wheels", **SENSED},
    "canadarm2": {"case": "1", **SENSED},
    "ets_vii": {"case": "1", "orbit": "ets_vii", "actuators": "wheels", **SENSED},
}
Link = tuple[float, float]
"""Mass, kg, and length, m."""
SATELLITES: dict[str, tuple[float, float, float, float, str, Sequence[Link]]] = {
    # mass of the bus, kg, its side, m, Coulomb and viscous friction, axes of the joints, links
    "picker": (60.0, 0.6, 0.02, 0.1, "zyyz", [(2.0, 0.1), (3.0, 0.5), (2.0, 0.4), (0.6, 0.1)]),
    "servicer": (
        *(180.0, 1.0, 0.08, 0.3, "zyyzyz"),
        [(4.0, 0.1), (6.0, 0.6), (4.0, 0.5), (2.0, 0.1), (1.5, 0.1), (0.8, 0.1)],
    ),
    "inspector": (
        *(300.0, 1.2, 0.15, 0.8, "zyzyzyz"),
        [(5.0, 0.15), (7.0, 0.55), (4.0, 0.15), (5.0, 0.5), (3.0, 0.12), (2.0, 0.12), (1.2, 0.1)],
    ),
}


def urdf(name: str) -> str:
    """Return an arm of boxes on a cubic satellite."""
    bus, side, coulomb, viscous, axes, links = SATELLITES[name]
    robot = Xml.Element("robot", name=name)
    _add_box(robot, "bus", bus, (side, side, side), 0.0)
    parent, at = "bus", 0.5 * side
    for number, (axis, (mass, length)) in enumerate(zip(axes, links, strict=True), 1):
        _add_box(robot, f"link{number}", mass, (0.1, 0.1, length), 0.5 * length)
        joint = Xml.SubElement(robot, "joint", name=f"joint{number}", type="revolute")
        Xml.SubElement(joint, "parent", link=parent)
        Xml.SubElement(joint, "child", link=f"link{number}")
        Xml.SubElement(joint, "origin", xyz=f"0 0 {at}")
        Xml.SubElement(joint, "axis", xyz={"y": "0 1 0", "z": "0 0 1"}[axis])
        Xml.SubElement(joint, "limit", lower="-2.8", upper="2.8", velocity="0.5", effort="20")
        Xml.SubElement(joint, "dynamics", friction=f"{coulomb}", damping=f"{viscous}")
        parent, at = f"link{number}", length
    return Xml.tostring(robot, "unicode")


def _add_box(
    robot: Xml.Element, name: str, mass: float, size: tuple[float, float, float], height: float
) -> None:
    inertial = Xml.SubElement(Xml.SubElement(robot, "link", name=name), "inertial")
    Xml.SubElement(inertial, "origin", xyz=f"0 0 {height}")
    Xml.SubElement(inertial, "mass", value=f"{mass}")
    squares = sum(edge**2 for edge in size)
    about = {f"i{k}{k}": f"{mass / 12.0 * (squares - size['xyz'.index(k)] ** 2)}" for k in "xyz"}
    Xml.SubElement(inertial, "inertia", about | {"ixy": "0", "ixz": "0", "iyz": "0"})


def scenario_of(name: str, folder: Path) -> dict[str, Any]:
    """Return a robot's scenario; the folder of one that is not shipped is made by `new`."""
    if name in SHIPPED:
        return {"robot": name, **SHIPPED[name]}
    robot, file = folder / name, folder / f"{name}.urdf"
    if not robot.exists():
        file.write_text(urdf(name), "utf-8")
        made = ["space-robot", "new", str(file), "--out", str(robot)]
        quick = ["--law", "ctc", "--law", "pd", "--evaluations", "1", "--runs", "2"]
        # the law is chosen below; with its first gains none may fly
        subprocess.run([*made, *quick], check=False, capture_output=True)
    return {"robot": f"{robot}/", "case": "1", "actuators": "small_wheels", **SENSED}


def processor_s() -> float:
    """Return the processor time of this process and of those that it has waited for, s."""
    used = [resource.getrusage(who) for who in (resource.RUSAGE_SELF, resource.RUSAGE_CHILDREN)]
    return sum(each.ru_utime + each.ru_stime for each in used)


def evidence(name: str, folder: Path, seed: int) -> dict[str, Any]:
    """Choose, fly the other draws, and return what came of both."""
    scenario = scenario_of(name, folder)
    options = ChoiceOptions(evaluations=EVALUATIONS, runs=RUNS, seed=seed, workers=cores())
    begun, used = time.monotonic(), processor_s()
    choice, _ = recommend(scenario, folder / f"{name}.{seed}", options, "docs/choice_evidence.py")
    seconds, used = time.monotonic() - begun, processor_s() - used
    criterion = CRITERIA[options.criterion]
    nominal = Scenario(**scenario).check()
    study = candidates_study(scenario, nominal, options.uncertainty)
    candidates = [each.candidate for each in choice.flown]
    how = options.criterion, DRAWS, OTHER_SEED, options.workers
    flown = fly_candidates(study, candidates, *how)
    order = ranked(flown, criterion)
    chosen = [each for each in flown if each.law == choice.law]
    others = [each for each in order if each.law != choice.law]
    return {
        "robot": name,
        "joints": nominal.robot.n,
        "seconds": seconds,
        "processor_s": used,
        "sentence": choice.sentence,
        "law": choice.law,
        "out": {**choice.out, **{each.law: each.reason for each in flown if each.reason}},
        "fronts": {law: [list(t.score[:2]) for t in f.best] for law, f in choice.fronts.items()},
        "medians": {each.law: each.median(criterion.value) for each in order},
        "compared": [
            {"other": c.other, "ratio": list(c.ratio), "finding": c.finding}
            for c in comparisons([*chosen, *others], criterion)
        ],
    }


def table(folder: Path) -> str:
    """Return a row for each robot that has been flown."""
    titles = "robot", "joints", "chosen", "median", "next in the other draws", "better than chosen"
    lines = [f"| {' | '.join(titles)} |", f"|{'---|' * len(titles)}"]
    for name in (*SHIPPED, *SATELLITES):
        if not (file := folder / f"{name}.json").exists():
            continue
        found = json.loads(file.read_text("utf-8"))
        others = sorted((v, law) for law, v in found["medians"].items() if law != found["law"])
        own = found["medians"][found["law"]]
        near = f"{others[0][1]}, {others[0][0] / own:.2f} times" if others else "-"
        better = [c["other"] for c in found["compared"] if c["finding"] == "worse"]
        row = name, found["joints"], found["law"], f"{own:.3g}", near, ", ".join(better) or "none"
        lines.append(f"| {' | '.join(map(str, row))} |")
    return "\n".join(lines)


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    names = [*SHIPPED, *SATELLITES]
    parser.add_argument("robots", nargs="*", metavar="ROBOT", help=f"of {', '.join(names)}")
    parser.add_argument("--folder", type=Path, default=Path("choice_evidence"))
    parser.add_argument("--seed", type=int, default=1, help="of the search")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    for name in asked.robots or names:
        found = evidence(name, asked.folder, asked.seed)
        suffix = "" if asked.seed == 1 else f".{asked.seed}"
        text = json.dumps(found, indent=1, default=str)
        (asked.folder / f"{name}{suffix}.json").write_text(text, "utf-8")
        print(f"{name}: {found['sentence']} ({found['seconds']:.0f} s)", flush=True)
    print(table(asked.folder))


if __name__ == "__main__":
    main()
