"""A node's process: ROS up, parameters in, the loop, a clean end, an exit code."""

from __future__ import annotations

import gc
import signal
import sys
import time
from collections.abc import Callable, Sequence
from typing import NoReturn, Protocol, TypeVar

from .process_environment import set_defaults

set_defaults()

import rclpy  # noqa: E402  (the environment must be set before)
import rclpy.utilities  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from rclpy.node import Node  # noqa: E402
from rclpy.signals import SignalHandlerOptions  # noqa: E402

from ..configuration import NodeSettings  # noqa: E402
from ..errors import InputError, SpaceRobotError  # noqa: E402
from .endpoints import Out  # noqa: E402
from .parameters import declare_settings, refuse_unknown  # noqa: E402
from .scheduling import ask_for_fifo  # noqa: E402

Schema = TypeVar("Schema", bound=NodeSettings)

SERVICE_PERIOD_S = 0.1
"""A look for parameter calls takes a millisecond, a whole tick's time: not too often."""
LISTENER_PERIOD_S = 0.02
REMIND_S = 5.0


class Loop(Protocol):
    """What a node does; made with its parameters, then run."""

    def run(self) -> None:
        """Return at the end, or when the shell is stopping."""


class Shell:
    """What a loop needs of its process: whether to stop, and time for parameter services."""

    def __init__(self, node: Node) -> None:
        self.node = node
        self.stopping = False
        self._executor = SingleThreadedExecutor()
        self._executor.add_node(node)
        self._next_service = 0.0
        for number in (signal.SIGINT, signal.SIGTERM):
            signal.signal(number, self._stop)

    def _stop(self, number: int, frame: object) -> None:
        self.stopping = True

    def log(self, text: str) -> None:
        """Say something on the node's log."""
        self.node.get_logger().info(text)

    def serve(self) -> None:
        """Let parameter services run if it is time again; call it often."""
        now = time.monotonic()
        if now >= self._next_service:
            self._next_service = now + SERVICE_PERIOD_S
            self._executor.spin_once(timeout_sec=0.0)

    def wait_for_listeners(self, outputs: Sequence[Out], names: Sequence[str]) -> None:
        """Return when the named nodes listen to all of ``outputs``, or on a signal."""
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
    loop: Callable[[Shell, Schema], Loop],
    changeable: tuple[str, ...] = (),
    arguments: list[str] | None = None,
) -> NoReturn:
    """Run a node until its loop returns, then exit.

    Exit code 0 at the end or on SIGINT or SIGTERM, 2 on bad input, 1 on a failed flight, each
    failure with one line on standard error.
    """
    code = 0
    try:
        rclpy.init(args=arguments, signal_handler_options=SignalHandlerOptions.NO)
    except Exception as error:  # RCLError is private; whatever it is, the arguments are at fault
        print(f"{schema.node}: error: {str(error).splitlines()[0]}", file=sys.stderr)
        sys.exit(InputError.exit_code)
    node = rclpy.create_node(schema.node)
    try:
        shell = Shell(node)
        settings = declare_settings(node, schema, changeable)
        ready = loop(shell, settings)
        refuse_unknown(node)
        gc.collect()
        gc.freeze()  # what lives until the end need not be looked through in the loop
        if settings.fifo_priority:
            shell.log(ask_for_fifo(settings.fifo_priority))
        ready.run()
    except SpaceRobotError as error:
        print(f"{schema.node}: error: {error}", file=sys.stderr, flush=True)
        code = error.exit_code
    finally:
        node.destroy_node()
        rclpy.utilities.try_shutdown()
    sys.exit(code)
