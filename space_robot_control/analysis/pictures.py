"""The pictures of one flight, or of several overlaid: the paper's figures, pointing, latency."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import NamedTuple

from matplotlib.figure import Figure

from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, laws_of

from .course import Course
from .figures import (
    BaseTorque,
    chatter,
    control_results,
    desired_joints,
    errors_and_torques,
    junctions,
    latency_histogram,
    pointing,
    save_figure,
)
from .table import flown


class Picture(NamedTuple):
    """A figure on disk."""

    caption: str
    png: Path
    svg: Path


class Album:
    """Takes flights one after the other, keeps of each what the pictures need, and draws them.

    Figures 5 to 9 of the paper are drawn of a single flight as the paper has them; of several,
    errors and torques lie over one another as norms of the columns of Table V.
    """

    def __init__(self) -> None:
        self._courses: dict[str, Course] = {}
        self._torques: dict[str, BaseTorque] = {}
        self._missions: dict[bytes, tuple[str, Figure]] = {}
        self._first: Figure | None = None

    def add(self, name: str, log: FlightLog) -> None:
        """Take a flight."""
        reference = log.reference_joints[:: max(1, log.ticks // 100)]
        self._missions.setdefault(reference.tobytes(), (name, desired_joints(log)))
        if not self._courses:
            self._first = control_results(log, title(name, log))
        self._courses[name] = Course.of(log)
        self._torques[name] = BaseTorque.of(log)

    def save(self, folder: Path) -> list[Picture]:
        """Draw all pictures into ``folder``, each as PNG and SVG; older ones are replaced.

        Raises:
            InputError: a picture cannot be written there.
        """
        saved = []
        for stem, caption, draw in self._pictures():
            png, svg = save_figure(draw(), folder / stem)
            saved.append(Picture(caption, png, svg))
        return saved

    def _pictures(self) -> Iterator[tuple[str, str, Callable[[], Figure]]]:
        courses, torques = self._courses, self._torques
        several = len(self._missions) > 1
        for number, (name, figure) in enumerate(self._missions.values(), start=1):
            suffix, of = (f"_{number}", f" of {name}") if several else ("", "")
            yield f"desired_joints{suffix}", f"Desired joint angles{of} (Fig. 5)", _drawn(figure)
        if len(courses) == 1 and self._first is not None:
            caption = "Errors and torques of base and joints (Figs. 6 to 9)"
            yield "control_results", caption, _drawn(self._first)
        else:
            caption = "Errors and torques, norms over each group of axes (Figs. 6 to 9)"
            yield "control_results", caption, lambda: errors_and_torques(courses)
        if any(len(torque.junctions) for torque in torques.values()):
            caption = "Base torque x where two motions meet"
            yield "junctions", caption, lambda: junctions(torques)
        yield "chatter", "A stretch of base torque, and its spectrum", lambda: chatter(torques)
        if any(course.pointing for course in courses.values()):
            caption = "The end effector's pointing error in the inertial frame"
            yield "pointing", caption, lambda: pointing(courses)
        if any(course.latency_ms is not None for course in courses.values()):
            caption = "Time from a state's sending to its command's"
            yield "latency", caption, lambda: latency_histogram(courses)


def _drawn(figure: Figure) -> Callable[[], Figure]:
    """A drawing that has been done already."""
    return lambda: figure


def title(name: str, log: FlightLog) -> str:
    """What was flown, in a line."""
    laws = as_data(laws_of(log), log.timebase)
    return f"{name}: {flown({**log.flight, 'laws': laws})}"
