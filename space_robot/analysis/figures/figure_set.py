"""All figures of one flight or of several overlaid ones: the paper's, pointing, latency."""

from __future__ import annotations

import base64
from collections.abc import Callable, Collection, Iterable, Iterator
from functools import partial
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure
from typing_extensions import Self

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of

from ..analysed_log import AnalysedLog, PointingBudget
from ..plotted import KINDS, flown_quantities
from ..words import flown
from .base_torque import chatter, junctions
from .overlay import (
    FlightCurves,
    base_pointing,
    errors_and_torques,
    latency_histogram,
    pointing,
    ripple,
)
from .single_flight import control_results, desired_joints, kind_figure, limit_cycle
from .style import PAGE_WIDTH, save_figure


class SavedFigure(NamedTuple):
    """A figure on disk."""

    caption: str
    files: tuple[Path, ...]

    @property
    def data_uri(self) -> str:
        """Return the SVG as a data URI, for a self-contained page."""
        svg = self.files[0].with_suffix(".svg")
        return "data:image/svg+xml;base64," + base64.b64encode(svg.read_bytes()).decode()


class Drawing(NamedTuple):
    """A figure that is drawn on demand."""

    caption: str
    draw: Callable[[], Figure]

    @classmethod
    def of(cls, caption: str, figure: Figure) -> Self:
        """Return a figure that is drawn already."""
        return cls(caption, lambda: figure)


class FigureFolder(NamedTuple):
    """Folder of figures; can be used in several processes."""

    path: Path
    formats: Collection[str]
    """Of png, svg, pdf."""

    def save(self, figure: Figure, stem: str) -> None:
        """Write a figure."""
        save_figure(figure, self.path / stem, self.formats)

    def saved(self, captions: Iterable[tuple[str, str]]) -> list[SavedFigure]:
        """Return those of the figures that were written, from pairs of stem and caption."""
        return [
            SavedFigure(caption, (path,))
            for stem, caption in captions
            if (path := self.path / f"{stem}.svg").is_file()
        ]


class FigureSet:
    """Collects the data of flights one after the other, and draws their figures.

    A single flight is drawn as in Figures 5 to 9 of the paper. For several flights, errors and
    torques are overlaid as norms of the columns of Table V.
    """

    def __init__(self, budget: PointingBudget | None = None, width: float | None = None) -> None:
        """``budget``: of the base's pointing; ``width``: mm. None: the default.

        Figures of a certain width have no title: they are for a paper, where a caption has it.
        """
        self._budget, self._width = budget or PointingBudget(), width or PAGE_WIDTH
        self._has_titles = width is None
        self._curves: dict[str, FlightCurves] = {}
        self._missions: dict[bytes, tuple[str, Figure]] = {}
        self._first: Figure | None = None
        self._own: dict[str, dict[str, Drawing]] = {}
        """By flight and file name, of what it has: actuators, an orbit, gears."""

    def add(self, name: str, log: FlightLog) -> None:
        """Add a flight."""
        reference = log.reference_joints[:: max(1, log.ticks // 100)]
        self._missions.setdefault(reference.tobytes(), (name, desired_joints(log, self._width)))
        if not self._curves:
            heading = title(name, log) if self._has_titles else ""
            self._first = control_results(log, heading, self._width)
        self._curves[name] = FlightCurves.of(log, self._budget)
        if own := dict(_own_drawings(log.longest_stretch(), self._width)):
            self._own[name] = own

    def save(self, folder: Path, formats: Collection[str] = ("png", "svg")) -> list[SavedFigure]:
        """Draw all figures with data into ``folder``; existing files are replaced."""
        return [
            SavedFigure(drawing.caption, save_figure(figure, folder / stem, formats))
            for stem, drawing in self.drawings().items()
            if (figure := drawing.draw()).axes
        ]

    def drawings(self) -> dict[str, Drawing]:
        """Return the available figures by file name, without drawing them."""
        curves, drawings = self._curves, dict[str, Drawing]()
        torques = {n: c.base_torque for n, c in curves.items() if c.base_torque is not None}

        def add(stem: str, caption: str, draw: Callable[..., Figure], flights: object) -> None:
            drawings[stem] = Drawing(caption, partial(draw, flights, width=self._width))

        for number, (name, figure) in enumerate(self._missions.values(), start=1):
            suffix, whose = (f"_{number}", f" of {name}") if len(self._missions) > 1 else ("", "")
            caption = f"Desired joint angles{whose} (Fig. 5)"
            drawings[f"desired_joints{suffix}"] = Drawing.of(caption, figure)
        if len(curves) == 1 and self._first is not None:
            caption = "Errors and torques of base and joints (Figs. 6 to 9)"
            drawings["control_results"] = Drawing.of(caption, self._first)
        else:
            caption = "Errors and torques, norms over each group of axes (Figs. 6 to 9)"
            add("control_results", caption, errors_and_torques, curves)
        if torques:
            add("junctions", "Base torque x where two motions meet", junctions, torques)
            add("chatter", "A stretch of base torque, and its spectrum", chatter, torques)
        add("ripple", "Spectrum of the torques' ripple", ripple, curves)
        for number, (name, own) in enumerate(self._own.items(), start=1):
            suffix, whose = (f"_{number}", f" of {name}") if len(curves) > 1 else ("", "")
            for stem, drawing in own.items():
                caption = f"{drawing.caption}{whose}"
                drawings[f"{stem}{suffix}"] = drawing._replace(caption=caption)
        if torques:
            caption = "The base's pointing error; limit: the band"
            add("base_pointing", caption, base_pointing, curves)
        caption = "The end effector's pointing error in the inertial frame"
        add("pointing", caption, pointing, curves)
        add("latency", "Time from a state's sending to its command's", latency_histogram, curves)
        return drawings


def _own_drawings(log: FlightLog, width: float) -> Iterator[tuple[str, Drawing]]:
    flight = AnalysedLog(log)
    for name, kind in KINDS.items() if log.ticks else ():
        drawn = (
            [q for _, q in flown_quantities(flight, [name]) if q.is_drawn] if kind.figure else []
        )
        if drawn:
            yield kind.figure, Drawing.of(kind.caption, kind_figure(log, drawn, width))
        if any(quantity.are_pulses for quantity in drawn):
            caption = "The attitude's limit cycle: rate error over attitude error"
            yield "limit_cycle", Drawing.of(caption, limit_cycle(log, width))


def title(name: str, log: FlightLog) -> str:
    """Return a title of a flight, in a line."""
    laws = as_data(laws_of(log), log.timebase)
    return f"{name}: {flown({**log.flight, 'laws': laws})}"
