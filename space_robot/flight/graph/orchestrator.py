"""A flight as a graph of real nodes: start, wait, follow, stop, check, report."""

from __future__ import annotations

import json
import shutil
import time
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import click
import yaml

from space_robot_model.robot.find import robot_files
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.bag.selection import Selection
from space_robot_msgs_py.config.files import GIVEN
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import FlightError, InputError, SpaceRobotError

from ...processes.interruption import handled_signals
from ...processes.scratch_folder import ScratchFolder
from ..compilation import compile_kernels
from ..flight_messages import bag_remark, check_bag_path
from ..plan import Flight
from ..telemetry import prepare_telemetry, telemetry_remark
from . import composed
from .composed import NAME
from .domain import is_quiet, ros_domain
from .following import follow
from .monitor import MONITOR
from .node_names import NODE_NAMES, PLANT, reset_with, wait_for
from .node_server import Program
from .node_services import own_name
from .processes import (
    Command,
    Graph,
    node_command,
    node_environment,
    ros_arguments,
    write_parameters,
)
from .telecommand_link import TelecommandLink

Parameters = Mapping[str, Mapping[str, Any]]
COMPOSED_DRAIN_S = 0.002
"""Period of the recorder in one process with the other nodes, which wait while it writes."""


def fly(
    flight: Flight,
    bag: Path,
    analyze: Callable[[FlightLog], dict[str, Any]],
    remarks: Iterable[str] = (),
) -> dict[str, Any]:
    """Fly on a ROS 2 graph and return the report of the recorded bag.

    ``graph`` in the report lists the events in the graph; its ``failures`` are reasons why the
    flight is not whole although it is complete.

    Raises:
        InputError: the bag cannot be made, or the domain is taken.
        FlightError: a node died, the graph stalled, messages were lost, or the user stopped it.
            The bag is closed, or gone if no tick was flown; no process is left.
    """
    check_bag_path(bag)
    require_ros()
    compile_kernels(bool(flight.plant.names.actuators))
    if database := prepare_telemetry(flight):
        remarks = [*remarks, telemetry_remark(flight, database)]
    options = flight.scenario.options
    namespace, own = options.namespace, [f"{node}_node" for node in options.without]
    with (
        _telecommands(flight) as link,
        ros_domain(options.domain, namespace, own) as domain,
        stop_signals() as stopped,
    ):
        is_empty = is_quiet(domain)
        _claim(bag)
        begin = time.monotonic()
        try:
            within = "" if namespace == topics.ROOT else f" in namespace {namespace}"
            _say(f"flying on ROS_DOMAIN_ID={domain}{within}, recording to {bag}")
            for remark in filter(None, (*remarks, bag_remark(flight))):
                _say(remark)
            with ScratchFolder() as scratch:
                folder = Path(scratch)
                parameters = flight_parameters(flight, bag, folder)
                if flight.scenario.process_faults:  # injected by the clock that the monitor hears
                    clock = f"{own_name(MONITOR)}:{topics.CLOCK.name}"
                    parameters["plant"]["wait_for"].append(clock)
                commands = _commands(flight, parameters, folder)
                with Graph(commands, node_environment(domain)) as graph:
                    if link:
                        link.begin(domain, namespace)
                    what_happened = follow(
                        graph, flight, parameters, domain, folder, stopped, is_empty
                    )
        except BaseException as error:
            if not _has_states(bag, namespace):
                shutil.rmtree(bag, ignore_errors=True)
            elif isinstance(error, SpaceRobotError):
                error.args = (f"{error}; what was flown is in {bag}",)
            raise
        _say(f"flown and recorded in {time.monotonic() - begin:.1f} s, start-up included")
    report = analyze(read_flight(bag, trust=True))
    report["graph"] = what_happened
    if link:
        report["graph"]["telecommands"] = {**link.counts, "refusals": link.refusals}
        for line in link.lines():
            _say(line)
    for warning in what_happened["warnings"]:
        _say(f"warning: {warning}")
    _check(report, flight)
    return report


@contextmanager
def _telecommands(flight: Flight) -> Iterator[TelecommandLink | None]:
    if address := flight.scenario.options.telecommands:
        with TelecommandLink(address, flight) as link:
            yield link
    else:
        yield None


def _commands(
    flight: Flight, parameters: Mapping[str, Mapping[str, Any]], folder: Path
) -> Mapping[str, Command]:
    options = flight.scenario.options
    started = {
        node: {**values, "autostart": False}
        for node, values in parameters.items()
        if node not in options.without
    }
    namespace = options.namespace
    if options.composed:
        file = folder / "parameters.yaml"
        return {NAME: Program(composed.__name__, ros_arguments(started, namespace, file))}
    return {n: node_command(n, values, namespace, folder) for n, values in started.items()}


def _claim(bag: Path) -> None:
    try:
        bag.mkdir(parents=True)
    except OSError:
        check_bag_path(bag)  # in words
        raise


def _has_states(bag: Path, namespace: str) -> bool:
    try:
        batches = Selection(open_bag(bag), {}, namespace).batches()
        return any(topic is topics.JOINT_STATES for topic, _ in batches)
    except (InputError, OSError):
        return False


def require_ros() -> None:
    """Check that ROS nodes can be started on this machine: that rclpy can be imported."""
    try:
        import rclpy  # noqa: F401
    except ImportError as error:
        missing = FlightError(
            f"rclpy cannot be imported ({error}): source your ROS 2 Jazzy, or "
            f"`{install_command('ros')}`; `space-robot simulate` flies without"
        )
        missing.help_topic = "install"
        raise missing from None


def flight_parameters(flight: Flight, bag: Path, folder: Path) -> dict[str, dict[str, Any]]:
    """Return the parameters of every node of a flight that is recorded to ``bag``.

    The files that they name are written to ``folder``.
    """
    parameters = {node: dict(values) for node, values in flight.scenario.parameters.items()}
    options = flight.scenario.options
    absent = [f"{node}_node" for node in options.without]
    parameters["plant"] |= {
        "ticks": flight.ticks,
        "wait_for": wait_for("plant", absent),
        "reset_with": reset_with(absent),
    }
    for node in ("controller", "mission"):
        parameters[node]["wait_for"] = wait_for(node, absent)
    if "controller" in options.without:
        parameters["plant"] |= {"own_controller": True, "join_timeout": options.join_timeout}
    elif options.without:
        parameters["controller"]["join_timeout"] = options.join_timeout
    parameters["recorder"] |= {"bag": str(bag.absolute()), "flight": json.dumps(flight.description)}
    if options.composed and "drain_period" not in options.parameters.get("recorder", {}):
        parameters["recorder"]["drain_period"] = COMPOSED_DRAIN_S
    numbers = flight.scenario.tree
    for node in ("plant", "controller", "mission"):
        option = "plant_robot" if node == "plant" and "plant_robot" in numbers else "robot"
        values = parameters[node]
        robot = values.get("robot")
        if option == "plant_robot" or robot == GIVEN:
            if node == "plant" and not values.get("mission"):  # that of the assumed robot
                values["mission"] = str(robot_files(str(robot)).mission or "")
            values["robot"] = _write(folder / f"{option}.yaml", numbers[option])
    if parameters["controller"].get("actuators") == GIVEN or "assumed_actuators" in numbers:
        assumed = flight.scenario.assumed_actuators.model_dump(mode="json")
        content = {"plant_node": {"ros__parameters": assumed}}
        parameters["controller"]["actuators"] = _write(folder / "assumed_actuators.yaml", content)
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
    """Collect signals that end a command in a list; the nodes, in groups of their own, get none."""
    arrived: list[int] = []
    with handled_signals(lambda number, frame: arrived.append(number)):
        yield arrived


def _say(text: str) -> None:
    click.echo(text, err=True)


def _write(path: Path, content: Any) -> str:
    path.write_text(yaml.safe_dump(content, sort_keys=False), encoding="utf-8")
    return str(path)


def launched_parameters(
    flight: Flight,
    bag: Path,
    autostart: bool,
    folder: Path,
    ros_parameters: Mapping[str, Mapping[str, Any]],
) -> Path:
    """Write a ROS parameter file for launched nodes, and the files it names; return its path.

    All kernels are compiled first; else every node would compile them.

    Args:
        flight: a checked plan.
        bag: the folder to record to.
        autostart: whether the nodes configure and activate themselves; they wait for one another.
        folder: for the files.
        ros_parameters: parameters by node that every ROS node has.
    """
    check_bag_path(bag)
    prepare_telemetry(flight)
    compile_kernels(bool(flight.plant.names.actuators))
    started = {
        node: {**values, "autostart": autostart, **ros_parameters.get(node, {})}
        for node, values in flight_parameters(flight, bag, folder).items()
    }
    return write_parameters(started, folder / "parameters.yaml")


class LaunchedGraph:
    """Nodes of one launched flight, which end together."""

    def __init__(self, names: Iterable[str] = NODE_NAMES) -> None:
        self._names = frozenset(names)
        self._running = set(self._names)
        self._has_failed = False

    @property
    def has_ended(self) -> bool:
        """True if no node runs any more."""
        return not self._running

    def note_end(self, name: str, exit_code: int, is_stopped: bool) -> str:
        """Note that a node's process has ended; ``is_stopped``: the whole launch is.

        Returns:
            Why the flight is not complete, once; empty if it is, or not known yet.
        """
        is_first = self._running == self._names
        self._running.discard(name)
        failure = ""
        if exit_code:
            failure = f"{name} ended with exit code {exit_code}"
        elif is_first and is_stopped:
            failure = "stopped before the flight's end"
        elif is_first and name != PLANT:
            failure = f"{name} ended before the flight did"
        if self._has_failed or not failure:
            return ""
        self._has_failed = True
        return failure


def report_failure(context: Any, failure: str) -> None:
    """Log a failure in a launch, which goes on, and ends with exit code 1.

    ``context``: launch's, whose event loop counts errors; an exception would shut all down.
    """
    context.asyncio_loop.call_exception_handler({"message": f"error: {failure}"})
