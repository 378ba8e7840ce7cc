"""The page of flights: one HTML file with the scene, synchronised plots and marks."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from importlib.resources import files
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from space_robot.analysis.report import template
from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_as_path
from space_robot_model.robot.parts import Spring
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, in_words, laws_of
from space_robot_msgs_py.errors import InputError

from ..analysis.described import check_joints, robot_of
from .actuators import ActuatorFrames, actuator_notes, described_actuators
from .animation import ShownFlight, animate
from .frames import RATE_HZ, shown_times
from .orbit import ArrowKind, arrow_kinds, is_in_orbit, sun_direction
from .plots import Mark, Plot, plots_of, shared_marks
from .scene import palette
from .shapes import shown_shapes

Array = NDArray[np.float64]


@dataclass(frozen=True)
class ViewOptions:
    """Options of a page."""

    side_by_side: bool = False
    """True to draw robots side by side, even if all are the same."""
    rate: float = RATE_HZ
    """Poses per second of flight."""
    title: str = ""
    """Title of the page; empty: the flights' names."""
    dark: bool = True
    """True for light on dark."""
    plots: tuple[str, ...] = ()
    """Kinds of the plots that are shown first, see `plotted.KINDS`; empty: the usual ones."""


def flights_page(
    logs: Mapping[str, FlightLog],
    robots: Mapping[str, Robot],
    options: ViewOptions,
    advance: Callable[[int], Callable[[], None]],
) -> str:
    """Return the self-contained page of flights.

    Args:
        logs: by name, at least one.
        robots: that flew, by the same names.
        options: of the page.
        advance: called with the number of frames, then after each frame.

    Raises:
        InputError: viser is not installed, or a flight has no state.
    """
    colours = palette(options.dark)
    flights = [
        ShownFlight(name, log, robots[name], colours[k % len(colours)])
        for k, (name, log) in enumerate(logs.items())
    ]
    is_same_robot = len({(robot.name, robot.body_names) for robot in robots.values()}) == 1
    times = shown_times(list(logs.values()), options.rate)
    side_by_side = options.side_by_side or not is_same_robot
    scene = animate(flights, times, side_by_side, options.dark, advance)
    plots = plots_of(logs, robots, colours, options.plots)
    notes = [note for log in logs.values() for note in _actuator_notes(log, times)]
    if absent := set(options.plots) - {plot.kind for plot in plots}:
        notes.append(f"Not in the recording: {', '.join(sorted(absent))}.")
    return render(
        options.title or ", ".join(logs),
        scene,
        [PageBag(f.name, f.colour, _description(f), f.log.defects) for f in flights],
        plots,
        shared_marks(logs),
        float(times[0]),
        options.dark,
        _legend(logs, options.dark),
        list(dict.fromkeys(notes)),
    )


def _actuator_notes(log: FlightLog, times: Array) -> list[str]:
    flown = described_actuators(log)
    has_any = flown.wheel_count or flown.thruster_count
    slowdown = ActuatorFrames.of(log, flown, times).slowdown if has_any else 1.0
    return actuator_notes(flown, slowdown)


def shown_robot(log: FlightLog, name: str = "") -> Robot:
    """Return the robot of a flight: by ``name``, or from the bag if it is empty.

    Joints that are passive in the bag are so in a named robot, too, since a URDF has no springs.
    Of the bag's robot meshes are files that a bag names: only of a trusted one they are kept.

    Raises:
        InputError: the robot does not exist, is unknown, or has other joints than the bag.
    """
    if name:
        springs = dict.fromkeys(log.passive_names, Spring(0.0, 0.0))
        with suppress(InputError):  # unknown springs move nothing that is drawn
            own = robot_of(log)
            springs |= zip(own.passive_names, own.springs, strict=True)
        robot = find_robot(robot_as_path(name)).with_springs(springs)
        check_joints(robot, log)
        return robot
    robot = robot_of(log)
    if log.trusted:
        return robot
    return replace(robot, visuals=tuple(replace(shape, mesh="") for shape in robot.visuals))


def remarks_on(logs: Mapping[str, FlightLog], robots: Mapping[str, Robot]) -> list[str]:
    """Return problems of the recordings and the robots' shapes, one line each."""
    lines = [f"{name}: {text}" for name, log in logs.items() for text in log.defects]
    for name, robot in robots.items():
        lines += shown_shapes(robot).remarks
        if any(shape.shape == "mesh" and not shape.mesh for shape in robot.visuals):
            lines.append(f"{name}: mesh files that the bag names are drawn with --trust")
    return list(dict.fromkeys(lines))


def _legend(logs: Mapping[str, FlightLog], dark: bool) -> list[ArrowKind]:
    """Return the arrows that are shown; none without an orbit."""
    in_orbit = [log for log in logs.values() if is_in_orbit(log)]
    has_sun = any(sun_direction(log) is not None for log in in_orbit)
    return arrow_kinds(has_sun, dark) if in_orbit else []


def _description(flight: ShownFlight) -> str:
    log = flight.log
    law = in_words(as_data(laws_of(log), log.timebase)) or str(log.flight.get("controller", ""))
    case = log.flight.get("case")
    return ", ".join(filter(None, [law, flight.robot.name, f"case {case}" if case else ""]))


class PageBag(NamedTuple):
    """A flight on the page."""

    name: str
    colour: str
    what: str
    warnings: Sequence[str] = ()
    """Defects of its recording, a sentence each."""


def render(
    title: str,
    scene: str,
    bags: Sequence[PageBag],
    plots: Sequence[Plot],
    marks: Sequence[Mark],
    start: float,
    dark: bool,
    arrows: Sequence[ArrowKind] = (),
    notes: Sequence[str] = (),
) -> str:
    """Render the self-contained page.

    Args:
        title: of the page.
        scene: viser's page of the scene.
        bags: that are shown.
        plots: in order, with a common time.
        marks: on the time axis.
        start: time of the first frame, s.
        dark: whether the page is light on dark.
        arrows: at the bases of robots in orbit.
        notes: on how things are drawn, a sentence each.
    """
    folder = files(__package__).joinpath("templates")
    data = {
        "plots": [
            {
                "title": plot.title,
                "unit": plot.unit,
                "logarithmic": plot.is_logarithmic,
                "pulses": plot.are_pulses,
                "shown": plot.is_shown,
                "limits": list(plot.limits),
                "series": [
                    {
                        "label": s.label,
                        "colour": s.colour,
                        "wanted": s.is_wanted,
                        "values": _digits(s.values, plot.is_logarithmic),
                    }
                    for s in plot.series
                ],
            }
            for plot in plots
        ],
        "marks": [
            {
                "start": m.start,
                "stop": m.stop if math.isfinite(m.stop) else None,
                "text": m.text,
                "kind": m.kind,
            }
            for m in marks
        ],
        "time": np.round(plots[0].time, 4).tolist() if plots else [],
        "start": start,
        "dark": dark,
    }
    return template("space_robot.view", "view.html.j2").render(
        title=title,
        scene=scene,
        bags=bags,
        dark=dark,
        uplot=folder.joinpath("uPlot.iife.min.js").read_text("utf-8"),
        uplot_css=folder.joinpath("uPlot.min.css").read_text("utf-8"),
        css=folder.joinpath("view.css").read_text("utf-8"),
        arrows=arrows,
        notes=notes,
        script=folder.joinpath("view.js").read_text("utf-8"),
        data=data,
    )


def _digits(values: Array, is_logarithmic: bool) -> list[Any]:
    known = np.isfinite(values) & ~(is_logarithmic & (values <= 0.0))
    return [float(f"{x:.4g}") if k else None for x, k in zip(values, known, strict=True)]
