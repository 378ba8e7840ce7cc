"""All checks of the machine, in the order in which they are shown."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

from space_robot_msgs_py.config.installation import requirements

from .checked_item import ROS, CheckedItem
from .packages import check_packages, check_python


def examine(clock_s: float | None = None) -> Iterator[CheckedItem]:
    """Yield the results of all checks; no flight and no node is started.

    Imports wait, so that a package that is missing or broken is a result, too.

    Args:
        clock_s: duration of the measurement of deadlines, s; None: 2 s.
    """
    yield check_python()
    yield from check_packages(requirements())
    flights = check_flights()
    yield flights
    if flights.prevents_flights:  # what follows imports the same
        return
    yield from _examine_machine(clock_s)


def check_flights() -> CheckedItem:
    """Import what flights in one process need, and resolve the default flight without flying it."""
    from space_robot_msgs_py.config.text import one_line_of

    try:
        from ..flight.plan import FlightPlan, resolve

        plan = resolve(FlightPlan()).options
    except Exception as error:  # whatever fails here would end a flight
        text = f"no flight can be prepared ({one_line_of(error)})"
        advice = "reinstall space_robot, with the versions of constraints.txt"
        return CheckedItem("flights", "missing", text, advice, is_required=True)
    text = f"a flight under {plan.controller} can be prepared in one process"
    return CheckedItem("flights", "ok", text, is_required=True)


def _examine_machine(clock_s: float | None) -> Iterator[CheckedItem]:
    from space_robot_msgs_py.compiled.cache import cache_directory

    from ..flight.compilation import MARK, mark_file
    from .clock import DURATION_S, check_deadlines, check_scheduling, measure_lateness
    from .ros import check_ros
    from .storage import check_disk, check_kernels, check_memory
    from .tools import check_tools

    yield check_kernels(cache_directory(), mark_file(MARK))
    yield check_scheduling()
    yield check_memory()
    yield check_disk(Path.cwd())
    duration = DURATION_S if clock_s is None else clock_s
    yield check_deadlines(measure_lateness(duration_s=duration))
    yield from check_ros()
    yield from check_tools()


def can_fly(items: Iterable[CheckedItem]) -> bool:
    """Return True if nothing prevents flights in one process."""
    return not any(item.prevents_flights for item in items)


def can_fly_with_ros(items: Sequence[CheckedItem]) -> bool:
    """Return True if nothing prevents flights as ROS 2 nodes."""
    return can_fly(items) and any(i.name == ROS and i.status != "missing" for i in items)
