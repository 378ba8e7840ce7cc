"""The pictures of the report: the mission, the laws side by side, each row by itself."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from concurrent.futures import Executor, Future
from typing import NamedTuple

from matplotlib.figure import Figure

from ...analysis.figures import BaseTorque, chatter, desired_joints, junctions
from ...flight.plan import Flight, FlightPlan
from ...flight.simulate import unflown
from .flights import ROBOT, Result, Row
from .gallery import Gallery
from .report import Chapter

FIGURE_OF_CASE = {"1": "6", "2": "7", "3": "8", "4-1": "9a", "4-2": "9b"}


class Comparison(NamedTuple):
    """A picture of all laws."""

    stem: str
    caption: str
    draw: Callable[[Mapping[str, BaseTorque]], Figure]


MISSION = "figure5_desired_joints"
COMPARISONS = (
    Comparison("chatter", "Chatter of the base torque in case 1", chatter),
    Comparison("junctions", "Base torque at the junction of the two motions, case 1", junctions),
)


def start_comparisons(
    pool: Executor, results: Sequence[Result], duration: float | None, gallery: Gallery
) -> Iterator[Future[None]]:
    """Draw the mission and the comparisons of ``results`` in other processes."""
    flights = {r.row.controller: r.base_torque for r in results if r.base_torque is not None}
    if flights:
        yield pool.submit(_draw_mission, duration, gallery)
        for comparison in COMPARISONS:
            yield pool.submit(_draw_comparison, comparison, flights, gallery)


def _draw_mission(duration: float | None, gallery: Gallery) -> None:
    log = unflown(Flight(FlightPlan(robot=ROBOT, duration=duration)))
    gallery.hang(desired_joints(log), MISSION)


def _draw_comparison(
    comparison: Comparison, flights: Mapping[str, BaseTorque], gallery: Gallery
) -> None:
    gallery.hang(comparison.draw(flights), comparison.stem)


def chapters(rows: Sequence[Row], gallery: Gallery) -> Iterator[Chapter]:
    """The pictures that were drawn."""
    laws = [(MISSION, "Figure 5: desired joint angles"), *(c[:2] for c in COMPARISONS)]
    if pictures := gallery.pictures(laws):
        yield Chapter("The mission, and the laws beside one another", pictures)
    for case, figure in FIGURE_OF_CASE.items():
        captions = [
            (row.stem, f"Figure {figure}: {row.controller}, {row.shown.title}")
            for row in rows
            if row.case == case
        ]
        if pictures := gallery.pictures(captions):
            yield Chapter(f"Case {case}", pictures)
