"""A choice as tables, JSON, a figure and a page."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from ..analysis.figures.figure_set import SavedFigure
from ..analysis.figures.style import COLOURS, house_style, page, save_figure
from ..analysis.report import template
from ..console.files import make_folder, write_text
from ..console.tables import Column, Group, JudgedCell, Table
from ..console.terminal import json_text
from ..processes.software import versions
from .criteria import CRITERIA
from .front import Front
from .recommend import Recommendation
from .robot_files import CAMPAIGN_FILE

CAMPAIGN_LAWS, CAMPAIGN_RUNS = 4, 200
"""Laws and runs of the campaign that continues the comparison."""


def candidates_table(choice: Recommendation, notes: Sequence[str] = ()) -> Table:
    """Return the laws, the best one first, with what their candidates flew."""
    criterion = CRITERIA[choice.options.criterion]
    order = {each.law: number for number, each in enumerate(choice.order, 1)}
    flown = {each.law: each for each in choice.flown}
    comparisons = {c.other: c for c in choice.compared}
    rows: list[list[Any]] = []
    for law in sorted(choice.fronts, key=lambda law: (order.get(law, math.inf), law)):
        value = ripple = None
        if each := flown.get(law):
            value, ripple = each.median(criterion.value), 100.0 * each.candidate.score.ripple
            value = value if math.isfinite(value) else None
        if law == choice.law:
            verdict = JudgedCell("", "chosen", "good")
        elif law in choice.out:
            verdict = JudgedCell(f"{choice.out[law]}:", "out", "bad")
        else:
            word = {"better": "worse", "worse": "better"}.get(comparisons[law].finding, "alike")
            verdict = JudgedCell(f"{1.0 / comparisons[law].ratio.value:.3g} times,", word, "open")
        rows.append([order.get(law), law, value, ripple, verdict])
    columns = [Column("rank", "", "d"), Column("law", is_label=True), Column("median", "", ".3g")]
    columns += [Column("ripple", "%", ".2g"), Column("beside the first", is_label=True)]
    title = f"{criterion.text}, {choice.options.runs} draws"
    return Table(title, columns, [Group(rows)], notes)


def report(choice: Recommendation) -> dict[str, Any]:
    """Return a choice as data for `json_text`."""
    options = choice.options
    return {
        "law": choice.law,
        "sentence": choice.sentence,
        "criterion": options.criterion,
        "scenario": dict(choice.scenario),
        "runs": options.runs,
        "seed": options.seed,
        "evaluations": options.evaluations,
        "order": [each.law for each in choice.order],
        "out": dict(choice.out),
        "candidates": {
            each.law: {
                "gains": {k: v.tolist() for k, v in each.candidate.gains.gains.items()},
                "acceleration_filter_hz": each.candidate.gains.corner_hz,
                "trials": dict(each.candidate.score.metrics),
                "value": each.median(CRITERIA[options.criterion].value),
            }
            for each in choice.flown
        },
        "compared": [
            {"law": c.law, "other": c.other, "finding": c.finding, "ratio": c.ratio.value}
            | {"p": c.p_better, "better": c.better, "worse": c.worse}
            for c in choice.compared
        ],
        "fronts": {
            law: [{"ripple": t.score.ripple, "error": t.score.error} for t in front.best]
            for law, front in choice.fronts.items()
        },
        "versions": versions(),
    }


def campaign_text(choice: Recommendation, folder: Path, command: str) -> str:
    """Return a campaign of the best laws, which continues the comparison."""
    laws = [f"{c.candidate.controller}={folder / c.law}/" for c in choice.order[:CAMPAIGN_LAWS]]
    scenario = dict(choice.scenario)
    study = {"scenario": scenario, "laws": laws, "vary": choice.vary, "runs": CAMPAIGN_RUNS}
    head = f"# Made by `{command}`: the best laws, each with its gains, over more draws.\n"
    return head + yaml.safe_dump(study, sort_keys=False, allow_unicode=True, width=100)


def fronts_figure(fronts: Mapping[str, Front], chosen: str = "") -> Figure:
    """Draw error against ripple for each law; a dot is a gain set on its front."""
    figure = page(95.0)
    axes = figure.add_subplot()
    draw_fronts(axes, {law: [t.score[:2] for t in f.best] for law, f in fronts.items()}, chosen)
    axes.set(xlabel="ripple of the torques, % of the largest in the mission", ylabel="error")
    if any(front.best for front in fronts.values()):
        axes.legend(loc="center left", bbox_to_anchor=(1.01, 0.5), frameon=False)
    return figure


def draw_fronts(
    axes: Axes, fronts: Mapping[str, Sequence[Sequence[float]]], chosen: str = ""
) -> None:
    """Draw fronts, each of pairs of error and ripple, with one colour and line for each law."""
    for number, (law, front) in enumerate(fronts.items()):
        if not front:
            continue
        points = np.array(front)
        axes.step(
            100.0 * points[:, 1],
            points[:, 0],
            where="post",
            color=COLOURS[number % len(COLOURS)],
            linestyle=("-", "--")[number // len(COLOURS) % 2],
            linewidth=2.2 if law == chosen else 1.2,
            marker=".",
            label=law,
        )
    axes.set(xscale="log", yscale="log")
    axes.grid(True, which="major", alpha=0.3)


def write_report(choice: Recommendation, folder: Path, command: str) -> Path:
    """Write page, figure, JSON and campaign; return the page.

    Raises:
        InputError: they cannot be written.
    """
    make_folder(folder)
    with house_style():
        files = save_figure(fronts_figure(choice.fronts, choice.law), folder / "fronts")
    text = template("space_robot.choice", "choice.html.j2").render(
        robot=str(choice.scenario.get("robot", "paper")),
        sentence=choice.sentence,
        tables=[candidates_table(choice)],
        figure=SavedFigure("Error against ripple: the fronts of the laws", files),
        scenario=yaml.safe_dump(dict(choice.scenario), sort_keys=False),
        options=choice.options,
        command=command,
    )
    write_text(text, folder / "index.html", replace=True)
    write_text(json_text(report(choice)), folder / "choice.json", replace=True)
    (folder / CAMPAIGN_FILE).unlink(missing_ok=True)  # of an earlier choice
    if choice.order:
        write_text(campaign_text(choice, folder, command), folder / CAMPAIGN_FILE)
    return folder / "index.html"
