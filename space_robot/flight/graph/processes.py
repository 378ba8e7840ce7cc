"""Processes of the nodes: start, monitoring, stop and cleanup."""

from __future__ import annotations

import json
import math
import os
import shutil
import signal
import subprocess
import tempfile
import time
from collections.abc import Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Any

from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.process import clean_environment, defaults, lifeline
from space_robot_msgs_py.topics import ROOT

from ...processes import MODULES
from .node_server import ForkedProcess, Program, node_server

PACKAGE = "space_robot"
TAIL_LINES = 5
POLL_S = 0.005
Command = Program | Sequence[str]
"""A program is forked, a command line is started."""
ERROR = ": error: "
"""Stands in a line that says why a process ends."""


def has_ros2_run() -> bool:
    """Return True if the ``ros2`` command is there and knows this package's executables."""
    prefixes = os.environ.get("AMENT_PREFIX_PATH", "").split(os.pathsep)
    return shutil.which("ros2") is not None and any(
        (Path(prefix) / "share/ament_index/resource_index/packages" / PACKAGE).exists()
        and os.access(Path(prefix) / "lib" / PACKAGE / "plant_node", os.X_OK)
        for prefix in prefixes
        if prefix
    )


def begin_loading() -> None:
    """Let the server of the nodes load what they need; else the first node waits for it."""
    if not has_ros2_run():
        node_server()


def node_environment(domain: int) -> dict[str, str]:
    """Return a node's environment: the project's defaults unless the user set others."""
    return {**defaults(), **clean_environment(), **lifeline(), "ROS_DOMAIN_ID": str(domain)}


def node_command(node: str, parameters: Mapping[str, Any], namespace: str, folder: Path) -> Command:
    """Return the command of a node: ``ros2 run`` where it is available, else Python.

    Its parameters are written to ``folder``.
    """
    arguments = ros_arguments({node: parameters}, namespace, folder / f"{node}_parameters.yaml")
    if has_ros2_run():
        return ["ros2", "run", PACKAGE, f"{node}_node", *arguments]
    return Program(MODULES[node], arguments)


def ros_arguments(
    parameters: Mapping[str, Mapping[str, Any]], namespace: str, file: Path
) -> list[str]:
    """Return ROS command-line arguments for a namespace and the parameters of nodes, in a file.

    A command line holds no long ones, and ROS takes those on it for the root namespace's nodes.
    """
    write_parameters(parameters, file)
    remapping = [] if namespace == ROOT else ["-r", f"__ns:={namespace}"]
    return ["--ros-args", *remapping, "--params-file", str(file)]


def write_parameters(parameters: Mapping[str, Mapping[str, Any]], file: Path) -> Path:
    """Write a ROS parameter file of nodes; return its path."""
    content = {
        f"/**/{node}_node": {"ros__parameters": values} for node, values in parameters.items()
    }
    file.write_text(json.dumps(content), encoding="utf-8")  # JSON is YAML, which ROS reads
    return file


class SpawnedProcess(subprocess.Popen[bytes]):
    """A command line in a process group of its own, see `ForkedProcess`."""

    def __init__(self, command: Sequence[str], output: int, environment: Mapping[str, str]) -> None:
        super().__init__(
            command,
            stdin=subprocess.PIPE,
            stdout=output,
            stderr=subprocess.STDOUT,
            env=dict(environment),
            start_new_session=True,
        )

    def close(self) -> None:
        """Close its standard input."""
        assert self.stdin is not None
        self.stdin.close()


class NodeProcess:
    """One node in a process group of its own, its output kept in a file.

    Its standard input is a lifeline: when this process ends, however it does, so does the node.
    """

    def __init__(self, node: str, command: Command, environment: Mapping[str, str]) -> None:
        self.node = node
        self._stopped = False
        self._output = tempfile.TemporaryFile()  # noqa: SIM115  (closed in `close`)
        output = self._output.fileno()
        self._process = (
            ForkedProcess(command, output, environment)
            if isinstance(command, Program)
            else SpawnedProcess(command, output, environment)
        )

    @property
    def pid(self) -> int:
        """Number of the process, and of its group."""
        return self._process.pid

    @property
    def exit_code(self) -> int | None:
        """Exit code of the process; None while it runs."""
        return self._process.poll()

    def exit_summary(self) -> str:
        """Describe how the process ended."""
        time.sleep(0.1)  # let it finish its last line
        code = self.exit_code or 0
        how = f"with exit code {code}" if code >= 0 else f"by signal {-code}"
        return f"{self.node} ended {how}"

    def early_end(self) -> FlightError:
        """Return the error for a process that ended too early."""
        return FlightError(f"{self.exit_summary()} before the flight did:\n{self.output_tail()}")

    def output_tail(self) -> str:
        """Return the end of its output, and earlier errors."""
        self._output.seek(0)
        lines = self._output.read().decode(errors="replace").strip().splitlines()
        errors = [line for line in lines[:-TAIL_LINES] if ERROR in line]
        tail = errors[-TAIL_LINES:] + lines[-TAIL_LINES:]
        return "\n".join(f"  {line}" for line in tail) or "  (it said nothing)"

    def signal(self, number: int) -> None:
        """Send a signal to the whole group: ``ros2 run`` would keep it to itself."""
        with suppress(ProcessLookupError):
            try:
                os.killpg(self.pid, number)
            except ProcessLookupError:
                if self.exit_code is None:  # just forked, it is in no group of its own yet
                    os.kill(self.pid, number)

    def ask_to_end(self) -> None:
        """Interrupt it, as Ctrl-C would."""
        self.signal(signal.SIGCONT)  # a stopped process would not hear the rest
        self.signal(signal.SIGINT)

    def stop(self, patience_s: float = 10.0) -> None:
        """Stop the process: SIGINT, SIGTERM, SIGKILL; return when its group is gone."""
        if self._stopped:
            return
        self._stopped = True
        self.ask_to_end()
        for number, wait_s in ((signal.SIGINT, patience_s), (signal.SIGTERM, 2.0)):
            if self.exit_code is not None:
                break
            self.signal(number)
            self._wait(wait_s)
        self.signal(signal.SIGKILL)
        self._wait(math.inf)

    def _wait(self, timeout_s: float) -> None:
        deadline = time.monotonic() + timeout_s
        while self.exit_code is None and time.monotonic() < deadline:
            time.sleep(POLL_S)

    def close(self) -> None:
        """Let go of its output and its lifeline."""
        self._output.close()
        self._process.close()


class Graph:
    """Processes of one flight; all are stopped when the context ends."""

    def __init__(self, commands: Mapping[str, Command], environment: Mapping[str, str]):
        """``commands``: the command line of each node, or of the process that hosts them all."""
        self._commands, self._environment = commands, environment
        self.nodes: dict[str, NodeProcess] = {}
        self._leader = "plant" if "plant" in commands else next(iter(commands))

    def __enter__(self) -> Graph:
        try:
            for node, command in self._commands.items():
                self.nodes[node] = NodeProcess(node, command, self._environment)
        except BaseException:
            self.__exit__()
            raise
        return self

    def __exit__(self, *exception: object) -> None:
        self.stop()
        for node in self.nodes.values():
            node.close()

    def stop(self) -> None:
        """Stop all running nodes, the recorder last, to record their last messages."""
        plant, recorder = self.nodes.get("plant"), self.nodes.get("recorder")
        if plant:
            plant.stop()  # first: what it asks must still be answered
        for node in self.nodes.values():
            if node is not recorder:
                node.ask_to_end()
        for node in sorted(self.nodes.values(), key=lambda node: node is recorder):
            node.stop()

    @property
    def leader(self) -> NodeProcess:
        """The process that ends, with exit code 0, when the flight has come to its end."""
        return self.nodes[self._leader]

    def host_process(self, node: str) -> NodeProcess:
        """The process of a node."""
        return self.nodes.get(node, self.leader)

    def restart(self, name: str, command: Command) -> None:
        """Replace a process that is dead or hangs."""
        old = self.nodes[name]
        old.signal(signal.SIGKILL)
        old.stop()
        old.close()
        self.nodes[name] = NodeProcess(name, command, self._environment)

    def check(self) -> bool:
        """Return True if the plant has completed the flight.

        Raises:
            FlightError: a process has ended too early; with the end of its output.
        """
        for node in self.nodes.values():
            if node.exit_code is not None and (node.exit_code != 0 or node is not self.leader):
                raise node.early_end()
        return self.leader.exit_code == 0
