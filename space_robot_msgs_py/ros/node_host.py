"""Host of the nodes of a process: startup, lifecycle, stepping of loops, shutdown.

Usually a process hosts one node; a composed graph has several nodes in one process.
"""

from __future__ import annotations

import faulthandler
import os
import signal
import sys
import textwrap
from collections.abc import Sequence
from typing import Any, NoReturn

from .process import set_defaults

set_defaults()

import rclpy  # noqa: E402  (the environment must be set before)
import rclpy.utilities  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402

from ..config.settings import NodeSettings, leaves  # noqa: E402
from ..config.validation import short  # noqa: E402
from ..errors import InputError, SpaceRobotError  # noqa: E402
from .managed_node import AUTOSTART, ManagedNode, NodeKind  # noqa: E402
from .node_scheduler import NodeScheduler  # noqa: E402
from .process import hold_to_standard_input  # noqa: E402

ENDING_SIGNALS = (signal.SIGINT, signal.SIGTERM, signal.SIGHUP, signal.SIGQUIT)


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
            _print_usage(schemas, others)
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except InputError as error:
        sys.exit(_say(who, error))
    except Exception as error:  # RCLError is private; it means invalid arguments
        sys.exit(_say(who, InputError(str(error).splitlines()[0])))
    nodes = [ManagedNode(kind) for kind in kinds]
    scheduler = NodeScheduler(nodes)
    signals: list[int] = []
    for number in ENDING_SIGNALS:
        signal.signal(number, lambda number, frame: signals.append(number))
    hold_to_standard_input()
    code = 0
    try:
        for node in nodes:
            node.claim_name()
        for node in nodes:
            if node.autostart and not signals:
                node.start()
        while not signals and scheduler.take():
            pass
    except SpaceRobotError as error:
        code = _say(who, error)
    try:
        for node in reversed(nodes):
            try:
                node.end()
            except SpaceRobotError as error:
                code = code or _say(node.get_name(), error)
    finally:
        for node in nodes:
            node.destroy_node()
        rclpy.utilities.try_shutdown()
    sys.stdout.flush()
    sys.stderr.flush()
    # all is closed except threads of the middleware, which may crash (once in thousands of times)
    # during the normal shutdown of the interpreter
    os._exit(code)


def _print_usage(schemas: Sequence[type[NodeSettings]], others: Sequence[str]) -> None:
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
