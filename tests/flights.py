"""Running ``space-robot`` in tests as a user would, in ROS domains of their own."""

from __future__ import annotations

import io
import os
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, redirect_stderr, redirect_stdout, suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import pytest
from command import run_program
from forked import END_S, SPACE_ROBOT, Forked

from space_robot_msgs_py.ros.locks import nodes_in
from space_robot_msgs_py.ros.process import DEFAULTS

if TYPE_CHECKING:
    import psutil

    from space_robot.flight.plan import Flight
    from space_robot_msgs_py.bag.flight_log import FlightLog

Start = Callable[..., Forked]
"""Starts a node with parameters."""
COMMAND = [sys.executable, "-m", "space_robot.cli.main"]
RESERVED = "/reserved"
"""A namespace that a test holds in a domain, so that nobody who looks for a free one takes it."""


def ros_environment() -> dict[str, str]:
    """Discovery on this machine only; the orchestrator picks a free domain."""
    environment = {**os.environ, **DEFAULTS}
    environment.pop("ROS_DOMAIN_ID", None)
    return environment


def space_robot(
    *arguments: str, timeout: float = 150.0, python_path: Path | None = None
) -> subprocess.CompletedProcess[str]:
    """Run ``space-robot`` as a user would."""
    environment = ros_environment()
    if python_path:
        paths = [str(python_path), environment.get("PYTHONPATH", "")]
        environment["PYTHONPATH"] = os.pathsep.join(path for path in paths if path)
    return run_program([*COMMAND, *arguments], timeout=timeout, env=environment)


def planned(**options: Any) -> Flight:
    """A flight of `simulate` with some options."""
    from space_robot.flight.plan import Flight, Scenario, resolve

    return Flight(resolve(Scenario.model_validate(options)))


def simulated(bag: Path | None = None, **options: Any) -> FlightLog:
    """The log of a flight in this process."""
    from space_robot.flight.simulate import simulate

    return simulate(planned(**options), bag)


def forked_space_robot(*arguments: str) -> Forked:
    """Begin ``space-robot`` in a process forked from a loaded one: see `forked`."""
    return Forked.of_command([SPACE_ROBOT, *arguments], ros_environment())


def space_robot_here(*arguments: str) -> subprocess.CompletedProcess[str]:
    """Run ``space-robot`` in this process: what it starts anew takes seconds of the processor.

    For tests of what a command does. Those of how it starts, ends or is ended use `space_robot`.
    """
    from space_robot.cli.main import main

    streams = {
        name: io.TextIOWrapper(io.BytesIO(), "utf-8", write_through=True) for name in ("out", "err")
    }
    with pytest.MonkeyPatch.context() as patch:
        for name, value in DEFAULTS.items():
            patch.setenv(name, os.environ.get(name, value))
        patch.delenv("ROS_DOMAIN_ID", raising=False)
        with (
            redirect_stdout(streams["out"]),
            redirect_stderr(streams["err"]),
            pytest.raises(SystemExit) as ended,
        ):
            main(arguments)
    code = int(ended.value.code or 0)
    out, err = (stream.buffer.getvalue().decode() for stream in streams.values())
    return subprocess.CompletedProcess([*COMMAND, *arguments], code, out, err)


@contextmanager
def ended(process: subprocess.Popen[str]) -> Iterator[None]:
    """Kill a process that a failed test leaves: the context of `Popen` waits for its end."""
    try:
        yield
    finally:
        process.kill()


def wait_for_nodes(domain: int, timeout_s: float = 60.0) -> None:
    """Return when a node has begun in a domain.

    A flight that finds the domain empty at its start need not look out for others.
    """
    until = time.monotonic() + timeout_s
    while not nodes_in(domain):
        assert time.monotonic() < until
        time.sleep(0.02)


class PausedFlight:
    """A ``fly --paused`` in a process of its own, as soon as its nodes are active."""

    def __init__(self, bag: Path, domain: int, *options: str) -> None:
        self.bag, self._where = bag, ("--domain", str(domain))
        self.process = forked_space_robot(
            "fly", "--paused", "--bag", str(bag), *self._where, *options
        )
        self._errors: list[str] = []
        assert self.process.stderr
        while not self._errors or "configured and active: " not in self._errors[-1]:
            self._errors.append(self.process.stderr.readline())
            assert self._errors[-1], self._errors

    def sim(self, *words: str, code: int = 0) -> str:
        """``space-robot sim``; what it says, in one line."""
        ran = space_robot_here("sim", *words, *self._where)
        assert ran.returncode == code, ran.stderr
        (line,) = (ran.stderr or ran.stdout).splitlines()
        return line

    def nodes(self) -> dict[str, psutil.Process]:
        """The processes of its nodes by name."""
        import psutil

        nodes = {}
        for process in psutil.Process(self.process.pid).children(recursive=True):
            with suppress(psutil.Error, IndexError):  # it has just ended
                name = process.cmdline()[0]
                if name.endswith(("_node", "composed")):
                    nodes[name.removesuffix("_node")] = process
        return nodes

    def end(self) -> tuple[int, str, str]:
        """Wait for its end; exit code and output."""
        output, errors = self.process.communicate(END_S)
        return self.process.returncode, output, "".join(self._errors) + errors


@dataclass
class Flown:
    """A finished graph flight."""

    report: dict[str, Any]
    bag: Path
    standard_error: str

    @property
    def bag_report(self) -> dict[str, Any]:
        """What the report says of the bag: without what happened in the graph, and its end."""
        other = {"graph", "outcome", "reason", "ended_at_s"}
        return {key: value for key, value in self.report.items() if key not in other}
