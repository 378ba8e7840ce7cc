"""A node's process: ROS up, the lifecycle, the loop while active, a clean end, an exit code."""

from __future__ import annotations

import faulthandler
import gc
import signal
import sys
import textwrap
import time
from collections.abc import Callable, Sequence
from typing import NoReturn, TypeVar

from .process_environment import set_defaults

set_defaults()

import rclpy  # noqa: E402  (the environment must be set before)
import rclpy.utilities  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402

from ..config.settings import NodeSettings, leaves  # noqa: E402
from ..config.validation import short  # noqa: E402
from ..errors import InputError, SpaceRobotError  # noqa: E402
from .endpoints import RawPublisher  # noqa: E402
from .lifeline import hold_to_standard_input  # noqa: E402
from .managed_node import AUTOSTART, Loop, ManagedNode  # noqa: E402
from .scheduling import ask_for_fifo  # noqa: E402

Schema = TypeVar("Schema", bound=NodeSettings)

SERVICE_PERIOD_S = 0.1
"""A look for service calls takes a millisecond, a whole tick's time: not too often."""
SERVICE_SHARE = 0.1
"""Of a loop's time, for service calls that wait one behind another."""
LONGEST_PAUSE_S = 1.0
LISTENER_PERIOD_S = 0.02
REMIND_S = 5.0


class NodeHost:
    """What a loop needs of its process: whether to stop, and time for services."""

    def __init__(self, node: ManagedNode[Schema]) -> None:
        self.node = node
        self.signalled = False
        """Whether the process has been told to end."""
        self._next_service = self._next_report = 0.0
        for number in (signal.SIGINT, signal.SIGTERM, signal.SIGHUP):
            signal.signal(number, self._stop)
        hold_to_standard_input()

    def _stop(self, number: int, frame: object) -> None:
        self.signalled = True

    @property
    def stopping(self) -> bool:
        """Whether the loop must return: the node is not active any more, or ends."""
        return self.signalled or not self.node.is_active

    def log(self, text: str) -> None:
        """Say something on the node's log."""
        self.node.get_logger().info(text)

    def serve(self) -> None:
        """Let services run and report the health if it is time again; call it often.

        Not once the loop must return: a transition would take its topics from under its hands.
        """
        if self.stopping:
            return
        now = time.monotonic()
        if now >= self._next_service:
            has_run = self.node.calls.run_one()
            begin, now = now, time.monotonic()
            # after one call look for another soon, but let them take no more than their share;
            # the answer to a client that has gone takes the middleware 0.1 s
            pause = min((now - begin) / SERVICE_SHARE, LONGEST_PAUSE_S)
            self._next_service = now + (pause if has_run else SERVICE_PERIOD_S)
        if now >= self._next_report:
            self._next_report = now + SERVICE_PERIOD_S
            self.node.report()

    def report_soon(self) -> None:
        """Report the health at the next `serve`: the mode has changed."""
        self._next_service = self._next_report = 0.0

    def wait_for_listeners(self, outputs: Sequence[RawPublisher], names: Sequence[str]) -> None:
        """Return when the named nodes listen to all of ``outputs``, or when stopping."""
        remind = time.monotonic() + REMIND_S
        while not self.stopping:
            missing = {out.topic.name: out.missing_listeners(names) for out in outputs}
            if not any(missing.values()):
                return
            if time.monotonic() > remind:
                remind += REMIND_S
                waiting = ", ".join(f"{', '.join(v)} on {k}" for k, v in missing.items() if v)
                self.log(f"waiting for {waiting}")
            self.serve()
            time.sleep(LISTENER_PERIOD_S)


def run_node(
    schema: type[Schema],
    make_loop: Callable[[NodeHost, Schema], Loop],
    changeable: tuple[str, ...] = (),
    arguments: list[str] | None = None,
) -> NoReturn:
    """Run a node until its loop returns while active, or until it is shut down.

    Exit code 0 at the end or on SIGINT, SIGTERM or SIGHUP, 2 on bad input, 1 on a failed flight,
    each failure with one line on standard error.
    """
    faulthandler.enable()  # a crash of the middleware leaves a word on where it was
    try:
        _, *others = rclpy.utilities.remove_ros_args(sys.argv if arguments is None else arguments)
        if others:
            _answer(schema, others)
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except InputError as error:
        sys.exit(_say(schema, error))
    except Exception as error:  # RCLError is private; whatever it is, the arguments are at fault
        sys.exit(_say(schema, InputError(str(error).splitlines()[0])))
    node: ManagedNode[Schema] = ManagedNode(
        schema, lambda node, settings: make_loop(host, settings), changeable
    )
    host = NodeHost(node)
    code = 0
    try:
        node.claim_name()
        if node.autostart:
            node.start()
        _live(node, host)
    except SpaceRobotError as error:
        code = _say(schema, error)
    try:
        node.end()
    except SpaceRobotError as error:
        code = code or _say(schema, error)
    finally:
        node.destroy_node()
        rclpy.utilities.try_shutdown()
    sys.exit(code)


def _answer(schema: type[NodeSettings], others: Sequence[str]) -> None:
    """Print the usage and end, if that is what the arguments that are not for ROS ask for.

    Raises:
        InputError: they ask for something else.
    """
    if not {"-h", "--help"} & set(others):
        raise InputError(
            f"unknown argument {short(others[0])}: a node takes only those of ROS, after "
            "--ros-args (--help tells more)"
        )
    name = schema.ros_name()
    parameters = ", ".join([AUTOSTART, *(key for key, _ in leaves(schema))])
    print(f"usage: {name} [--ros-args [-p NAME:=VALUE]... [--params-file FILE] [-r FROM:=TO]...]")
    print(textwrap.fill(f"parameters: {parameters}", 96, subsequent_indent="  "))
    sys.exit(0)


def _live(node: ManagedNode[Schema], host: NodeHost) -> None:
    """Run the loop whenever the node is active, until it has come to its end."""
    while not host.signalled and not node.is_shut_down:
        if not node.is_active or node.loop is None:
            node.calls.run_one(SERVICE_PERIOD_S)
            node.report()
            continue
        gc.collect()
        gc.freeze()  # what lives until the end need not be looked through in the loop
        if node.settings and node.settings.fifo_priority:
            host.log(ask_for_fifo(node.settings.fifo_priority))
        node.run_loop()
        if node.is_active:
            return


def _say(schema: type[NodeSettings], error: SpaceRobotError) -> int:
    print(f"{schema.ros_name()}: error: {error}", file=sys.stderr, flush=True)
    return error.exit_code
