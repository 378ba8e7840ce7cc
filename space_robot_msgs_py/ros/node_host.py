"""Host of the nodes of a process: startup, lifecycle, stepping of loops, shutdown.

Usually a process hosts one node; a composed graph has several nodes in one process.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import textwrap
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Generic, NoReturn, TypeVar

from .process import set_defaults

set_defaults()

import rclpy  # noqa: E402  (the environment must be set before)
import rclpy.utilities  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402

from ..config.settings import NodeSettings, leaves  # noqa: E402
from ..config.validation import short  # noqa: E402
from ..errors import InputError, SpaceRobotError  # noqa: E402
from .loop import Loop  # noqa: E402
from .managed_node import AUTOSTART, ManagedNode  # noqa: E402
from .node_scheduler import NodeScheduler  # noqa: E402
from .process import hold_to_standard_input  # noqa: E402

Schema = TypeVar("Schema", bound=NodeSettings)
ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


@dataclass(frozen=True)
class NodeKind(Generic[Schema]):
    """Definition of a kind of node."""

    schema: type[Schema]
    """Schema of its parameters, with the node's name."""
    make_loop: Callable[[ManagedNode[Schema], Schema], Loop]
    changeable: tuple[str, ...] = ()
    """Names of the parameters that can be changed in flight."""
    offer_services: Callable[[ManagedNode[Schema]], None] = lambda node: None
    """Creates services and parameters that exist in all lifecycle states."""

    def make_node(self) -> ManagedNode[Schema]:
        """Create the node in the state unconfigured."""
        return ManagedNode(self.schema, self.make_loop, self.changeable, self.offer_services)


class NodeHost:
    """Starts, steps and ends the nodes of this process, and serves their calls."""

    def __init__(self, nodes: Sequence[ManagedNode[Any]]) -> None:
        """Store the nodes in the order of their start."""
        self._nodes = nodes
        self._turns = NodeScheduler(nodes)
        self._is_signalled = False
        for number in ENDING_SIGNALS:
            signal.signal(number, self._stop)
        hold_to_standard_input()

    def _stop(self, number: int, frame: object) -> None:
        self._is_signalled = True

    def run(self) -> None:
        """Start the nodes with autostart, then serve and step all nodes.

        It ends at a signal, when a loop is complete, or when all nodes are shut down.

        Raises:
            SpaceRobotError: a node cannot be started, or its loop failed.
        """
        for node in self._nodes:
            node.claim_name()
        for node in self._nodes:
            if node.autostart and not self._is_signalled:
                node.start()
        take_turn = self._turns.take
        while not self._is_signalled and take_turn():
            pass

    def end(self) -> list[tuple[str, SpaceRobotError]]:
        """End all nodes, the last one first; return names and errors of nodes that failed."""
        failures = []
        for node in reversed(self._nodes):
            try:
                node.end()
            except SpaceRobotError as error:
                failures.append((node.get_name(), error))
        return failures


def run_nodes(*kinds: NodeKind[Any], arguments: list[str] | None = None) -> NoReturn:
    """Run nodes in this process until a loop is complete, or until all are shut down.

    The exit code is 0 at the end or at one of `ENDING_SIGNALS`, 2 for invalid input, 1 for a failed
    flight; each failure gives one line on standard error.

    Args:
        kinds: the nodes in the order of their start; they end in reverse order.
        arguments: the command line (None: that of this process).
    """
    faulthandler.enable()  # a traceback for crashes of the middleware
    schemas = [kind.schema for kind in kinds]
    who = schemas[0].ros_name() if len(kinds) == 1 else "composed nodes"
    try:
        _, *others = rclpy.utilities.remove_ros_args(sys.argv if arguments is None else arguments)
        if others:
            _answer(schemas, others)
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except InputError as error:
        sys.exit(_say(who, error))
    except Exception as error:  # RCLError is private; it means invalid arguments
        sys.exit(_say(who, InputError(str(error).splitlines()[0])))
    nodes = [kind.make_node() for kind in kinds]
    host = NodeHost(nodes)
    code = 0
    try:
        host.run()
    except SpaceRobotError as error:
        code = _say(who, error)
    try:
        for name, failure in host.end():
            code = code or _say(name, failure)
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.utilities.try_shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    # all is closed except threads of the middleware, which may crash (once in thousands of times)
    # during the normal shutdown of the interpreter
    os._exit(code)


def _answer(schemas: Sequence[type[NodeSettings]], others: Sequence[str]) -> None:
    """Print the usage and exit, if this is requested by the arguments that are not ROS's.

    Raises:
        InputError: other arguments.
    """
    if not {"-h", "--help"} & set(others):
        raise InputError(
            f"unknown argument {short(others[0])}: a node accepts only those of ROS, after "
            "--ros-args (see --help)"
        )
    for schema in schemas:
        name = schema.ros_name()
        parameters = ", ".join([AUTOSTART, *(key for key, _ in leaves(schema))])
        print(
            f"usage: {name} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]"
        )
        print(textwrap.fill(f"parameters: {parameters}", 96, subsequent_indent="  "))
    sys.exit(0)


def _say(who: str, error: SpaceRobotError) -> int:
    print(f"{who}: error: {error}", file=sys.stderr, flush=True)
    return error.exit_code
