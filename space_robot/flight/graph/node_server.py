"""Fork server for nodes, with all modules and kernels preloaded.

A node of its own makes 1 s of imports and of reading compiled kernels. The server does that
once, while the command that starts the nodes still looks at its options.
"""

from __future__ import annotations

import atexit
import gc
import inspect
import os
import signal
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from importlib import import_module
from multiprocessing.connection import Connection

from setproctitle import setproctitle

from ...processes import MODULES
from ...processes.fork_server import ForkServer, accept_signals, serve_standard_input


@dataclass(frozen=True)
class Program:
    """A module whose ``main()`` is to be run in a process of its own."""

    module: str
    arguments: Sequence[str]

    @property
    def title(self) -> str:
        """The process' name in lists of processes, and in those of ROS' log files."""
        return self.module.rpartition(".")[2]


class ForkedProcess:
    """A program in a process group of its own.

    Its standard input is a connection to this process, which the kernel closes with this process.
    """

    def __init__(self, program: Program, output: int, environment: Mapping[str, str]) -> None:
        """``output``: the open file that takes what it prints."""
        self._server = node_server()
        try:
            self.pid, self._connection = self._server.fork(output)
        except ConnectionError:  # somebody has killed the server
            _server_for.cache_clear()
            self._server = node_server()
            self.pid, self._connection = self._server.fork(output)
        self._connection.send((program, dict(environment), os.getcwd()))

    def poll(self) -> int | None:
        """Return its exit code, below zero for a signal's number; None while it runs."""
        try:
            return self._server.exit_code(self.pid)
        except OSError:  # somebody has killed the server, so nobody knows
            return -signal.SIGKILL

    def close(self) -> None:
        """Close its standard input."""
        self._connection.close()


def node_server() -> ForkServer:
    """Return the server that forks the nodes of this process; the first call starts it."""
    return _server_for(os.getpid())


@cache
def _server_for(pid: int) -> ForkServer:
    """A process that is itself forked must not share its parent's."""
    server = ForkServer.as_program(__name__)
    atexit.register(server.close)
    return server


def run_program(connection: Connection, descriptors: Sequence[int], server: int) -> None:
    """Run the program received through the connection until it ends."""
    os.setsid()
    accept_signals(ignored=())
    program, environment, folder = connection.recv()
    for descriptor, number in ((connection.fileno(), 0), (descriptors[0], 1), (descriptors[0], 2)):
        os.dup2(descriptor, number)
    connection.close()
    os.close(descriptors[0])
    os.environ.clear()
    os.environ.update(environment)
    os.chdir(folder)
    for path in environment.get("PYTHONPATH", "").split(os.pathsep):
        if path and path not in sys.path:
            sys.path.append(path)
    sys.argv = [program.module, *program.arguments]
    setproctitle(program.title)
    import_module(program.module).main()


def main() -> None:
    """Load what nodes need, then fork them."""
    os.environ["SPT_NOENV"] = "1"  # a title must not be written over what /proc shows of it
    setproctitle("space_robot: server of the nodes")  # the first time, before that changes
    gc.disable()  # nothing of what is loaded is ever let go
    for module in MODULES.values():
        import_module(module)
    from space_robot_msgs_py import topics
    from space_robot_msgs_py.ros.endpoints import message_type

    from ..compilation import load_kernels

    load_kernels()
    for topic in topics.ALL:
        message_type(topic.type).__import_type_support__()
    # ROS' log looks for its caller in every module; what it finds is kept
    inspect.getmodule(inspect.currentframe())
    gc.freeze()  # a collection in a child would copy the pages that hold it all
    gc.enable()
    serve_standard_input(run_program)
    os._exit(0)  # who has started it waits for its end


if __name__ == "__main__":
    main()
