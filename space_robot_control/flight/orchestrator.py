"""A flight as a graph of real nodes: start, wait, follow, stop, check, report."""

from __future__ import annotations

import json
import signal
import time
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click

from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError

from ..analysis import analyse
from .compilation import compile_kernels
from .domain import ros_domain
from .following import follow
from .plan import Flight, check_bag_path
from .processes import Graph, node_command, node_environment


def fly(flight: Flight, bag: Path) -> dict[str, Any]:
    """Fly on a ROS 2 graph and return the report of the recorded bag.

    ``graph`` in the report says what happened in the graph; its ``failures`` are what keeps the
    flight from being whole though it was flown to its end.

    Raises:
        InputError: the bag cannot be made; nothing was started.
        FlightError: a node died, the graph stalled, messages were lost, or the user stopped it;
            the bag is closed and no process left.
    """
    check_bag_path(bag)
    require_ros()
    compile_kernels()
    with ros_domain(flight.plan.domain) as domain, stop_signals() as stopped:
        _say(f"flying on ROS_DOMAIN_ID={domain}, recording to {bag}")
        begin = time.monotonic()
        try:
            parameters = flight_parameters(flight, bag)
            commands = {
                node: node_command(node, {**values, "autostart": False})
                for node, values in parameters.items()
            }
            with Graph(commands, node_environment(domain)) as graph:
                what_happened = follow(graph, flight, parameters, domain, stopped)
        except FlightError as error:
            kept = f"; what was flown is in {bag}" if _has_messages(bag) else ""
            raise type(error)(f"{error}{kept}") from None
        _say(f"flown and recorded in {time.monotonic() - begin:.1f} s, start-up included")
    report = analyse(read_flight(bag, trust=True))
    report["graph"] = what_happened
    _check(report, flight)
    return report


def _has_messages(bag: Path) -> bool:
    return any(file.stat().st_size > 0 for file in bag.glob("*.mcap"))


def require_ros() -> None:
    """See that nodes can be started here.

    Raises:
        FlightError: rclpy cannot be imported.
    """
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        raise FlightError(
            f"rclpy cannot be imported ({error}): source your ROS 2 Jazzy, or install the [ros] "
            "extra; `space-robot simulate` flies without"
        ) from None


def flight_parameters(flight: Flight, bag: Path) -> dict[str, dict[str, Any]]:
    """The parameters of every node of a flight that is recorded to ``bag``."""
    parameters = {node: dict(given) for node, given in flight.parameters.items()}
    parameters["plant"] |= {
        "ticks": flight.ticks,
        "wait_for": ["controller_node", "mission_node", "recorder_node"],
    }
    parameters["controller"] |= {"wait_for": ["plant_node", "recorder_node"]}
    parameters["recorder"] |= {
        "bag": str(bag.absolute()),
        "flight": json.dumps(flight.description),
    }
    return parameters


def _check(report: dict[str, Any], flight: Flight) -> None:
    lost = {topic: count for topic, count in report["lost"].items() if count}
    if report["graph"]["failures"]:
        return  # the bag is not expected to be whole
    if lost:
        raise FlightError(f"the recorder lost messages: {lost}")
    if report["ticks"] != flight.ticks:
        raise FlightError(f"the bag holds {report['ticks']} whole ticks of {flight.ticks}")


@contextmanager
def stop_signals() -> Iterator[list[int]]:
    """A list that SIGINT and SIGTERM fill; the nodes, in groups of their own, do not get them."""
    arrived: list[int] = []
    numbers = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP)
    previous = {n: signal.signal(n, lambda n, frame: arrived.append(n)) for n in numbers}
    try:
        yield arrived
    finally:
        for number, handler in previous.items():
            signal.signal(number, handler)


def _say(text: str) -> None:
    click.echo(text, err=True)
