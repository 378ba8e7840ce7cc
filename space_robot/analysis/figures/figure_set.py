"""All figures of one flight or of several overlaid ones: the paper's, pointing, latency."""

from __future__ import annotations

import base64
from collections.abc import Callable, Iterable
from functools import partial
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of

from ..analysed_log import AnalysedLog, PointingBudget
from ..plotted import KINDS, quantities_of
from ..words import flown
from .base_torque import chatter, junctions
from .flight_curves import FlightCurves
from .overlay import base_pointing, errors_and_torques, latency_histogram, pointing, ripple
from .single_flight import control_results, desired_joints, kind_figure, limit_cycle
from .style import save_figure


class SavedFigure(NamedTuple):
    """A figure on disk."""

    caption: str
    svg: Path

    @property
    def data_uri(self) -> str:
        """Return the SVG as a data URI, for a self-contained page."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.svg.read_bytes()).decode()


class Drawing(NamedTuple):
    """A figure that is drawn on demand."""

    caption: str
    draw: Callable[[], Figure]


class FigureFolder(NamedTuple):
    """Folder of figures; can be used in several processes."""

    path: Path
    png: bool
    """True to write PNG files beside the SVG files."""

    def save(self, figure: Figure, stem: str) -> None:
        """Write a figure."""
        save_figure(figure, self.path / stem, png=self.png)

    def saved(self, captions: Iterable[tuple[str, str]]) -> list[SavedFigure]:
        """Return those of the figures that were written, from pairs of stem and caption."""
        return [
            SavedFigure(caption, path)
            for stem, caption in captions
            if (path := self.path / f"{stem}.svg").is_file()
        ]


class FigureSet:
    """Collects the data of flights one after the other, and draws their figures.

    A single flight is drawn as in Figures 5 to 9 of the paper. For several flights, errors and
    torques are overlaid as norms of the columns of Table V.
    """

    def __init__(self, budget: PointingBudget | None = None) -> None:
        """``budget``: of the base's pointing; None: the default."""
        self._budget = budget or PointingBudget()
        self._flights: dict[str, FlightCurves] = {}
        self._missions: dict[bytes, tuple[str, Figure]] = {}
        self._first: Figure | None = None
        self._parts: dict[str, dict[str, tuple[str, Figure]]] = {}
        """Caption and figure by file name, of what each flight has: actuators, an orbit, gears."""

    def add(self, name: str, log: FlightLog) -> None:
        """Add a flight."""
        reference = log.reference_joints[:: max(1, log.ticks // 100)]
        self._missions.setdefault(reference.tobytes(), (name, desired_joints(log)))
        if not self._flights:
            self._first = control_results(log, title(name, log))
        self._flights[name] = FlightCurves.of(log, self._budget)
        if parts := _parts(log.longest_stretch()):
            self._parts[name] = parts

    def save(self, folder: Path) -> list[SavedFigure]:
        """Draw all figures into ``folder`` as PNG and SVG; existing files are replaced.

        Figures without data are omitted.

        Raises:
            InputError: a figure cannot be written.
        """
        return [
            SavedFigure(drawing.caption, save_figure(figure, folder / stem)[-1])
            for stem, drawing in self.drawings().items()
            if (figure := drawing.draw()).axes
        ]

    def drawings(self) -> dict[str, Drawing]:
        """Return the available figures by file name, without drawing them."""
        flights, drawings = self._flights, dict[str, Drawing]()
        torques = {n: s.base_torque for n, s in flights.items() if s.base_torque is not None}

        def add(stem: str, caption: str, draw: Callable[[], Figure]) -> None:
            drawings[stem] = Drawing(caption, draw)

        several = len(self._missions) > 1
        for number, (name, figure) in enumerate(self._missions.values(), start=1):
            suffix, of = (f"_{number}", f" of {name}") if several else ("", "")
            caption = f"Desired joint angles{of} (Fig. 5)"
            add(f"desired_joints{suffix}", caption, partial(_drawn, figure))
        if len(flights) == 1 and self._first is not None:
            caption = "Errors and torques of base and joints (Figs. 6 to 9)"
            add("control_results", caption, partial(_drawn, self._first))
        else:
            caption = "Errors and torques, norms over each group of axes (Figs. 6 to 9)"
            add("control_results", caption, partial(errors_and_torques, flights))
        if torques:
            add("junctions", "Base torque x where two motions meet", partial(junctions, torques))
            caption = "A stretch of base torque, and its spectrum"
            add("chatter", caption, partial(chatter, torques))
        add("ripple", "Spectrum of the torques' ripple", partial(ripple, flights))
        for number, (name, figures) in enumerate(self._parts.items(), start=1):
            suffix, of = (f"_{number}", f" of {name}") if len(flights) > 1 else ("", "")
            for stem, (caption, figure) in figures.items():
                add(f"{stem}{suffix}", f"{caption}{of}", partial(_drawn, figure))
        if torques:
            caption = "The base's pointing error; dotted: the band"
            add("base_pointing", caption, partial(base_pointing, flights))
        caption = "The end effector's pointing error in the inertial frame"
        add("pointing", caption, partial(pointing, flights))
        caption = "Time from a state's sending to its command's"
        add("latency", caption, partial(latency_histogram, flights))
        return drawings


def _drawn(figure: Figure) -> Figure:
    return figure


def _parts(log: FlightLog) -> dict[str, tuple[str, Figure]]:
    """Return caption and figure by file name of what a flight has: actuators, orbit, gears."""
    flight, parts = AnalysedLog(log), dict[str, tuple[str, Figure]]()
    for name, kind in KINDS.items() if log.ticks else ():
        drawn = [q for _, q in quantities_of(flight, [name]) if q.is_drawn] if kind.figure else []
        if drawn:
            parts[kind.figure] = kind.caption, kind_figure(log, drawn)
        if drawn and any(quantity.are_pulses for quantity in drawn):
            caption = "The attitude's limit cycle: rate error over attitude error"
            parts["limit_cycle"] = caption, limit_cycle(log)
    return parts


def title(name: str, log: FlightLog) -> str:
    """Return a title of a flight, in a line."""
    laws = as_data(laws_of(log), log.timebase)
    return f"{name}: {flown({**log.flight, 'laws': laws})}"
