"""Eleven laws at their best: numbers and figure of law_league.md.

`python docs/law_league.py [NAME ...]` searches the fronts of all laws for each of `SETTINGS`, and
chooses a law for each robot as `space-robot choose` does; then the best three laws fly 200 other
draws. Writes FOLDER/NAME.json for each (`--folder`), and puts what is there into the page.
`--seed` is that of the search; the page has those of seed 1.
"""

from __future__ import annotations

import argparse
import json
import subprocess
import sys
import time
from collections.abc import Mapping, Sequence
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import Any
from xml.etree import ElementTree as Xml

from space_robot import Scenario
from space_robot.analysis.figures.style import house_style, page, save_figure
from space_robot.choice import ChoiceOptions, Uncertainty, recommend
from space_robot.choice.candidates import comparisons, fly_candidates, ranked
from space_robot.choice.criteria import CRITERIA
from space_robot.choice.law_search import prepare
from space_robot.choice.recommend import candidates_study
from space_robot.choice.report import draw_fronts
from space_robot.processes.executor import cores

sys.path.append(str(Path(__file__).parent / "flown"))
from flexible_joints import geared
from marks import markdown, put

HERE = Path(__file__).parent
PAGE = HERE / "law_league.md"
OTHER_SEED, DRAWS = 1000, 200
MANY = 160
"""Gain sets of each law in the settings, whose fronts are compared."""
MOST = 3
"""Laws that fly the other draws."""
FIRST_S = 40.0
"""Of the satellites' missions, which last two minutes."""
COMMAND = "docs/law_league.py"
SENSED = {"sensors": "fine", "navigation": "filtered"}
PAPER: dict[str, Any] = {"robot": "paper", "case": "1", **SENSED}
SETTINGS: dict[str, tuple[str, dict[str, Any], Uncertainty]] = {
    "rigid": ("masses known, no friction", {"friction": False}, Uncertainty(mass=0.0)),
    "masses": ("masses within 20 %, no friction", {"friction": False}, Uncertainty()),
    "friction": ("masses within 20 %, friction", {}, Uncertainty()),
    "gears": ("the same, joints on gears", {"plant_robot": geared(1e5, "motor")}, Uncertainty()),
}
"""Of the paper's robot: title, further options, what no law knows."""
LARGEST_RIPPLE = 0.5
"""That is drawn."""
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
    first = {"duration": FIRST_S}
    return {"robot": f"{robot}/", "case": "1", "actuators": "small_wheels", **SENSED, **first}


def evidence(name: str, folder: Path, seed: int) -> dict[str, Any]:
    """Choose, fly the other draws, and return what came of both."""
    scenario = scenario_of(name, folder)
    options = ChoiceOptions(seed=seed, workers=cores())
    begun, own = time.monotonic(), folder / f"{name}.{seed}"
    choice = recommend(scenario, own, options, COMMAND)
    seconds = time.monotonic() - begun
    criterion = CRITERIA[options.criterion]
    nominal = Scenario(**scenario).check()
    study = candidates_study(scenario, nominal, options.uncertainty)
    candidates = [each.candidate._replace(folder=f"{own / each.law}/") for each in choice.order]
    how = options.criterion, DRAWS, OTHER_SEED, options.workers
    flown = fly_candidates(study, candidates[:MOST], *how)
    order = ranked(flown, criterion)
    chosen = [each for each in flown if each.law == choice.law]
    others = [each for each in order if each.law != choice.law]
    return {
        "robot": name,
        "joints": nominal.robot.n,
        "seconds": seconds,
        "sentence": choice.sentence,
        "law": choice.law,
        "out": {**choice.out, **{each.law: each.reason for each in flown if each.reason}},
        "fronts": {law: [list(t.score[:2]) for t in f.best] for law, f in choice.fronts.items()},
        "order": {each.law: each.median(criterion.value) for each in choice.order},
        "medians": {each.law: each.median(criterion.value) for each in order},
        "compared": [
            {"other": c.other, "ratio": list(c.ratio), "finding": c.finding}
            for c in comparisons([*chosen, *others], criterion)
        ],
    }


def searched(name: str, seed: int) -> dict[str, Any]:
    """Return the fronts of all laws for one of the settings."""
    title, options, uncertainty = SETTINGS[name]
    how = ChoiceOptions(evaluations=MANY, seed=seed, workers=cores(), uncertainty=uncertainty)
    with TemporaryDirectory() as folder:
        search, _, _ = prepare({**PAPER, **options}, Path(folder), how, COMMAND)
        fronts = search.fronts()
    points = {front.law: [list(tried.score[:2]) for tried in front.best] for front in fronts}
    return {"title": title, "fronts": points}


# The page


def read(folder: Path, names: Sequence[str]) -> dict[str, Any]:
    """Return what is there, by name."""
    files = {name: folder / f"{name}.json" for name in names}
    return {n: json.loads(file.read_text("utf-8")) for n, file in files.items() if file.exists()}


def least(front: Sequence[Sequence[float]], ripple: float) -> float | None:
    """Return the least error on a front with at most so much ripple."""
    return min((error for error, own in front if own <= ripple), default=None)


def fronts_table(found: Mapping[str, Any], ripples: Sequence[float] = (0.01, 0.05)) -> str:
    """Return the least error of each law at two ripples, a column a setting and ripple."""
    columns = [(each, ripple) for each in found.values() for ripple in ripples]
    titles = [f"{name}: {100 * ripple:g} %" for name in found for ripple in ripples]
    rows = []
    for law in next(iter(found.values()))["fronts"]:
        values = [least(each["fronts"][law], ripple) for each, ripple in columns]
        rows.append([f"`{law}`", *("-" if v is None else f"{v:.2g}" for v in values)])
    return markdown(["law", *titles], rows)


def league(found: Mapping[str, Any]) -> str:
    """Return each law's median error on each robot, as a multiple of the chosen law's."""
    laws = sorted({law for each in found.values() for law in each["fronts"]})
    rows = [[f"`{law}`", *(standing(each, law) for each in found.values())] for law in laws]
    rows.append(["joints", *(str(each["joints"]) for each in found.values())])
    rows.append(["median error where 1 stands", *(f"{own(each):.2g}" for each in found.values())])
    return markdown(["law", *(f"`{name}`" for name in found)], rows)


def reference(each: Mapping[str, Any]) -> str:
    """Return the chosen law, or the best one if the other draws do not confirm the chosen one."""
    medians = each["medians"]
    return each["law"] if each["law"] in medians else min(medians, key=medians.__getitem__)


def own(each: Mapping[str, Any]) -> float:
    """Return the median of that law in the other draws."""
    return float(each["medians"][reference(each)])


def standing(each: Mapping[str, Any], law: str) -> str:
    """Return how a law stands beside the chosen one."""
    best = reference(each)
    if law == each["law"]:
        return "**1**" if law == best else "**out**"
    if law in each["medians"]:
        finding = next((c["finding"] for c in each["compared"] if c["other"] == law), "")
        word = {"better": "", "worse": " better"}.get(finding, " alike")
        return f"{each['medians'][law] / own(each):.2f}{word if best == each['law'] else ''}"
    if law in each["order"] and law not in each["out"]:
        return f"({each['order'][law] / each['order'][best]:.2g})"
    return "out"


def draw(found: Mapping[str, Any]) -> None:
    """Draw the fronts, a panel a setting."""
    with house_style():
        figure = page(150.0)
        panels = figure.subplots(2, 2, sharex=True, sharey=True)
        for axes, each in zip(panels.flat, found.values(), strict=False):
            draw_fronts(
                axes,
                {
                    law: [point for point in front if point[1] <= LARGEST_RIPPLE]
                    for law, front in each["fronts"].items()
                },
            )
            axes.set_title(each["title"])
        for axes in panels[1]:
            axes.set_xlabel("ripple of the torques, % of the largest")
        for axes in panels[:, 0]:
            axes.set_ylabel("error")
        lines, names = panels[0, 0].get_legend_handles_labels()
        figure.legend(lines, names, loc="outside right center", frameon=False)
        save_figure(figure, HERE / "law_fronts")
    HERE.joinpath("law_fronts.svg").unlink()


def renewed(text: str, folder: Path) -> str:
    """Return the page with tables of what is in a folder."""
    if fronts := read(folder, tuple(SETTINGS)):
        text = put(text, "fronts", fronts_table(fronts))
    if robots := read(folder, (*SHIPPED, *SATELLITES)):
        text = put(text, "robots", league(robots))
    return text


def main() -> None:
    """Run the command."""
    parser = argparse.ArgumentParser(description=__doc__)
    names = [*SETTINGS, *SHIPPED, *SATELLITES]
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"of {', '.join(names)}")
    parser.add_argument("--folder", type=Path, default=HERE / "law_league")
    parser.add_argument("--seed", type=int, default=1, help="of the search")
    parser.add_argument("--page", action="store_true", help="search nothing: write the page anew")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    suffix = "" if asked.seed == 1 else f".{asked.seed}"
    for name in () if asked.page else asked.names or names:
        is_setting = name in SETTINGS
        found = (
            searched(name, asked.seed) if is_setting else evidence(name, asked.folder, asked.seed)
        )
        text = json.dumps(found, indent=1, default=str)
        (asked.folder / f"{name}{suffix}.json").write_text(f"{text}\n", "utf-8")
        print(f"{name}: {found.get('sentence') or 'searched'}", flush=True)
    if fronts := read(asked.folder, tuple(SETTINGS)):
        draw(fronts)
    PAGE.write_text(renewed(PAGE.read_text("utf-8"), asked.folder), "utf-8")


if __name__ == "__main__":
    main()
