"""Page of flights: robots, scene, plots and marks."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from contextlib import suppress
from dataclasses import dataclass, replace

from space_robot_model.robot import Robot
from space_robot_model.robot.find import find_robot, robot_as_path
from space_robot_model.robot.parts import Spring
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.law_history import as_data, in_words, laws_of
from space_robot_msgs_py.errors import InputError

from ..analysis.described import check_joints, robot_of
from .actuators import actuator_notes
from .arrows import ArrowKind, arrow_kinds
from .film import FilmedFlight, film
from .frames import RATE_HZ, shown_times
from .marks import shared_marks
from .meshes import shown_shapes
from .orbit_frames import is_in_orbit, sun_direction
from .page import Shown, render
from .palette import palette
from .plots import plots_of


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
    """Kinds of the plots that are shown first, see `PLOT_KINDS`; empty: the usual ones."""


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
        FilmedFlight(name, log, robots[name], _law(log), colours[k % len(colours)])
        for k, (name, log) in enumerate(logs.items())
    ]
    of_one = len({(flight.robot.name, flight.robot.body_names) for flight in flights}) == 1
    times = shown_times(list(logs.values()), options.rate)
    scene = film(flights, times, options.side_by_side or not of_one, options.dark, advance)
    plots = plots_of(logs, robots, colours, options.plots)
    notes = list(
        dict.fromkeys(note for log in logs.values() for note in actuator_notes(log, times))
    )
    if absent := set(options.plots) - {plot.kind for plot in plots}:
        notes.append(f"Not in the recording: {', '.join(sorted(absent))}.")
    return render(
        options.title or ", ".join(logs),
        scene,
        [Shown(f.name, f.colour, _told(f), f.log.defects) for f in flights],
        plots,
        shared_marks(logs),
        float(times[0]),
        options.dark,
        _legend(logs, options.dark),
        notes,
    )


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


def _law(log: FlightLog) -> str:
    return in_words(as_data(laws_of(log), log.timebase)) or str(log.flight.get("controller", ""))


def _told(flight: FilmedFlight) -> str:
    case = flight.log.flight.get("case")
    words = [flight.law, flight.robot.name, f"case {case}" if case else ""]
    return ", ".join(filter(None, words))
