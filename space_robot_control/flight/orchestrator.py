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

from space_robot_msgs_py.bag import read_flight
from space_robot_msgs_py.errors import FlightError

from ..analysis import analyse
from .compilation import compile_kernels
from .display import flight_progress
from .domain import ros_domain
from .injection import Injector
from .lifecycle import LifecycleDriver
from .monitor import Event, Monitor
from .plan import Flight, check_bag_path
from .processes import MODULES, Graph, node_command, node_environment
from .watch import Watch

POLL_S = 0.1
INJECTING_POLL_S = 0.01
STALL_TIMEOUT_S = 60.0
ORDER = ("recorder", "mission", "controller", "plant")
BRING_UP = ((ORDER, "configure"), *(((node,), "activate") for node in ORDER))


class InterruptedFlightError(FlightError):
    """The user stopped the flight."""

    exit_code = 130


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
    with ros_domain(flight.plan.domain) as domain, _stop_signals() as stopped:
        _say(f"flying on ROS_DOMAIN_ID={domain}, recording to {bag}")
        begin = time.monotonic()
        try:
            parameters = flight_parameters(flight, bag)
            commands = {
                node: node_command(node, {**values, "autostart": False})
                for node, values in parameters.items()
            }
            with Graph(commands, node_environment(domain)) as graph:
                what_happened = _follow(graph, flight, parameters, domain, stopped)
        except FlightError as error:
            kept = f"; what was flown is in {bag}" if _has_messages(bag) else ""
            raise type(error)(f"{error}{kept}") from None
        _say(f"flown and recorded in {time.monotonic() - begin:.1f} s, start-up included")
    report = analyse(read_flight(bag))
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
    plan = flight.plan
    parameters = {node: plan.overrides(node) for node in MODULES}
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


def _follow(
    graph: Graph, flight: Flight, parameters: dict[str, dict[str, Any]], domain: int,
    stopped: list[int],
) -> dict[str, Any]:  # fmt: skip
    """Start the nodes, show the flight until the plant has ended it; what happened."""
    total_s = flight.ticks * flight.period
    last_clock_s = flight.plant_settings.clock_decimation * flight.period
    faults = flight.orchestrator_faults
    monitor = Monitor(domain)
    injector = Injector(faults, graph)
    restart = None
    if flight.plan.restart_controller:
        restart = node_command(
            "controller", {**parameters["controller"], "wait_for": ["plant_node"]}
        )
    killed = frozenset(fault.kind.partition("_")[2] for fault in faults)
    watch = Watch(graph, monitor, killed, restart)
    events: list[Event] = []
    first_tick_at = None
    last_time, last_change = 0.0, time.monotonic()
    try:
        with flight_progress(total_s, flight.controller.law.name) as show:
            show(0.0, "configuring the nodes")
            _bring_up(graph, monitor, stopped)
            show.say(f"configured and active: {', '.join(ORDER)}")
            show(0.0, "waiting for the nodes")
            while not watch.has_landed:
                if stopped:
                    raise InterruptedFlightError(f"stopped at {monitor.simulated_s:.2f} s")
                time.sleep(INJECTING_POLL_S if injector.is_busy else POLL_S)
                news = [*monitor.poll(), *injector.poll(monitor.simulated_s)]
                news += watch.poll(monitor.simulated_s)
                now = time.monotonic()
                if monitor.simulated_s > last_time or (first_tick_at is None and monitor.has_begun):
                    first_tick_at = first_tick_at or now
                    last_time, last_change = monitor.simulated_s, now
                    show(last_time, _remark(monitor.errors, last_time, now - first_tick_at))
                elif now - last_change > STALL_TIMEOUT_S:
                    words = "\n".join(f"{n}:\n{p.last_words()}" for n, p in graph.nodes.items())
                    raise FlightError(
                        f"no progress for {STALL_TIMEOUT_S:.0f} s at {last_time:.2f} s:\n{words}"
                    )
                if monitor.simulated_s < total_s - last_clock_s:  # what ends then is meant to
                    for event in news:
                        show.say(str(event))
                    events += news
            show(total_s, "")
        graph.stop()
        watch.bury_recorder()
        if stopped:
            raise InterruptedFlightError("stopped when the flight had landed")
        monitor.poll()  # the nodes' last reports
    finally:
        monitor.close()
    return {
        "events": [event._asdict() for event in events],
        "nodes": monitor.values,
        "restarts": watch.restarts,
        "failures": watch.failures,
    }


def _bring_up(graph: Graph, monitor: Monitor, stopped: list[int]) -> None:
    """Configure all nodes, then activate them, the plant last."""

    def check() -> None:
        graph.check()
        if stopped:
            raise InterruptedFlightError("stopped before the flight began")

    driver = LifecycleDriver(monitor.node)
    for nodes, transition in BRING_UP:
        names = [f"{node}_node" for node in nodes]
        for name in driver.change(names, transition, check):
            words = graph.nodes[name.removesuffix("_node")].last_words()
            raise FlightError(f"{name} refused to {transition}:\n{words}")


def _remark(errors: tuple[float, float] | None, simulated_s: float, wall_s: float) -> str:
    speed = f"{simulated_s / wall_s:.1f}x real time, " if wall_s > 0.5 else ""
    if errors is None:
        return speed
    return f"{speed}errors: attitude {errors[0]:.1e}, joints {errors[1]:.1e} rad"


def _check(report: dict[str, Any], flight: Flight) -> None:
    lost = {topic: count for topic, count in report["lost"].items() if count}
    if report["graph"]["failures"]:
        return  # the bag is not expected to be whole
    if lost:
        raise FlightError(f"the recorder lost messages: {lost}")
    if report["ticks"] != flight.ticks:
        raise FlightError(f"the bag holds {report['ticks']} whole ticks of {flight.ticks}")


@contextmanager
def _stop_signals() -> Iterator[list[int]]:
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
