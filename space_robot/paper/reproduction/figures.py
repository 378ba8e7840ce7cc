"""Figures of the report: the mission, the comparison of the laws, and one per row."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from functools import partial

from matplotlib.figure import Figure

from ...analysis.figures import chatter, desired_joints, junctions
from ...analysis.figures.figure_set import FigureFolder, SavedFigure
from ...analysis.figures.flight_curves import BaseTorque
from ...flight.flown_log import empty_log
from ...flight.plan import Flight, Scenario, resolve
from .flights import ROBOT, Result, TableRow

FIGURE_OF_CASE = {"1": "6", "2": "7", "3": "8", "4-1": "9a", "4-2": "9b"}
MISSION = "figure5_desired_joints"


COMPARISONS: dict[str, tuple[str, Callable[[Mapping[str, BaseTorque]], Figure]]] = {
    "chatter": ("Chatter of the base torque in case 1", chatter),
    "junctions": ("Base torque at the junction of the two motions, case 1", junctions),
}
"""Caption and drawing function of the figures of all laws, by file name."""


def comparisons(
    results: Sequence[Result], duration: float | None, folder: FigureFolder
) -> list[Callable[[], None]]:
    """Return functions that draw the mission and the comparisons of the laws in ``results``.

    They can be pickled, and called in another process.
    """
    flights = {r.row.controller: r.base_torque for r in results if r.base_torque is not None}
    if not flights:
        return []
    return [
        partial(_draw_mission, duration, folder),
        *(partial(_draw_comparison, stem, flights, folder) for stem in COMPARISONS),
    ]


def _draw_mission(duration: float | None, folder: FigureFolder) -> None:
    log = empty_log(Flight(resolve(Scenario(robot=ROBOT, duration=duration))))
    folder.save(desired_joints(log), MISSION)


def _draw_comparison(stem: str, flights: Mapping[str, BaseTorque], folder: FigureFolder) -> None:
    _, draw = COMPARISONS[stem]
    folder.save(draw(flights), stem)


def figure_groups(rows: Sequence[TableRow], folder: FigureFolder) -> dict[str, list[SavedFigure]]:
    """Return the drawn figures by heading: the mission's first, then by case."""
    groups = {
        "The mission, and comparison of the laws": [
            (MISSION, "Figure 5: desired joint angles"),
            *((stem, caption) for stem, (caption, _) in COMPARISONS.items()),
        ]
    }
    for case, number in FIGURE_OF_CASE.items():
        groups[f"Case {case}"] = [
            (row.stem, f"Figure {number}: {row.controller}, {row.shown.title}")
            for row in rows
            if row.case == case
        ]
    return {title: files for title, g in groups.items() if (files := folder.saved(g))}
