"""Flights whose processes die, one after the other: ``python tools/hostile --help``."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable, Iterator
from contextlib import closing, suppress
from functools import partial
from pathlib import Path

import click
import psutil

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.monitor import Monitor
from space_robot.processes import MODULES
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process import DEFAULTS

MARK = "SPACE_ROBOT_HOSTILE_TRIAL"
"""Environment variable by which the processes of a trial are found, whoever started them."""
LONGEST_S, LEAVING_S, TIMEOUT_S = 100.0, 5.0, 15.0
IN_FLIGHT = 1_000_000
"""Bytes of a bag with more than the reference that is sent in advance."""
FLOWN_S = 0.2
"""Simulated time after a restart that shows that the loop is closed again."""
PHASES = ("starting", "configuring", "flying", "landing")
SIGNALS = {"kill": signal.SIGKILL, "end": signal.SIGTERM, "interrupt": signal.SIGINT}
Attack = Callable[[int], list[str]]
"""Carries one out in a domain; what went wrong."""


class Trial:
    """A flight as a user starts it, watched from outside."""

    def __init__(self, domain: int, duration: float) -> None:
        self._ticks, self._mark = round(duration / 0.0005), uuid.uuid4().hex
        self._folder = tempfile.TemporaryDirectory(prefix="hostile_")
        self.bag = Path(self._folder.name) / "bag"
        options = ["--json", "--duration", str(duration), "--bag", str(self.bag)]
        self.process = subprocess.Popen(
            [sys.executable, "-m", "space_robot.cli.main", "fly", *options],
            env={**DEFAULTS, **os.environ, "ROS_DOMAIN_ID": str(domain), MARK: self._mark},
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def wait(self, condition: Callable[[], object]) -> bool:
        """Wait until something holds, or the flight has ended; whether it holds."""
        until = time.monotonic() + LONGEST_S
        while self.process.poll() is None and time.monotonic() < until:
            if condition():
                return True
            time.sleep(0.005)
        return bool(condition())

    def node(self, name: str) -> psutil.Process | None:
        """Return the process of a node, if there is one."""
        return next((p for p in self._processes() if p.name() == f"{name}_node"), None)

    def flies(self) -> bool:
        """Return True if ticks are recorded."""
        return sum(file.stat().st_size for file in self.bag.glob("*.mcap")) > IN_FLIGHT

    def end(self, loses_bag: bool = False) -> tuple[int, list[str]]:
        """Wait for the flight's end; its exit code, and what is not as it should be."""
        wrong = []
        try:
            output, said = self.process.communicate(timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            wrong.append(f"not over after {LONGEST_S:.0f} s")
            self.process.kill()
            output, said = self.process.communicate()
        code = self.process.returncode
        _, left = psutil.wait_procs(self._processes(), timeout=LEAVING_S)
        for process in left:
            wrong.append(f"left behind: {process}")
            process.kill()
        reason = said.partition("space-robot: error:")[2].strip()
        if "Traceback" in output + said:
            wrong.append(f"traceback: {said[-300:]}")
        if code == 0:
            report = json.loads(output)
            if any(report["lost"].values()) or report["ticks"] != self._ticks:
                wrong.append(f"exit code 0, but {report['ticks']} ticks, {report['lost']}")
        elif code != -signal.SIGKILL and (code not in (1, 2, 130, 143) or not reason):
            wrong.append(f"exit code {code} without a reason: {said.strip()[-300:]!r}")
        if self.flies():
            try:
                if not (loses_bag or open_bag(self.bag).finished):
                    wrong.append("the bag was not closed")
                if not (log := read_flight(self.bag)).whole.all():
                    wrong.append(f"{(~log.whole).sum()} rows of the bag are not whole")
            except SpaceRobotError as error:
                wrong.append(f"bag: {error}")
        self._folder.cleanup()
        return code, wrong

    def _processes(self) -> list[psutil.Process]:
        """Return those of this trial that live, without the flight's command itself."""
        found = []
        for process in psutil.process_iter():
            with suppress(psutil.Error):
                if process.pid != self.process.pid and process.environ().get(MARK) == self._mark:
                    found.append(process)
        return found


def kill(victim: str, phase: str, number: signal.Signals, domain: int) -> list[str]:
    """End a process in a phase of a flight; then fly again in the same domain."""
    trial = Trial(domain, duration=2.0)
    reached: dict[str, Callable[[], object]] = {
        "starting": lambda: trial.node("plant"),
        "configuring": trial.bag.exists,
        "flying": trial.flies,
        "landing": lambda: trial.flies() and not trial.node("plant"),
    }
    if trial.wait(reached[phase]):
        process = psutil.Process(trial.process.pid) if victim == "fly" else trial.node(victim)
        with suppress(psutil.Error):
            if process:  # else it has ended
                process.send_signal(number)
    _, wrong = trial.end(loses_bag=victim == "recorder" and number == signal.SIGKILL)
    code, then = Trial(domain, duration=0.1).end()
    did_fly = [] if code == 0 else [f"the next flight did not fly: exit code {code}"]
    return [*wrong, *then, *did_fly]


def restart(victim: str, domain: int) -> list[str]:
    """Start nodes by hand, kill one in flight, start it again: the loop closes by itself."""
    with (
        tempfile.TemporaryDirectory(prefix="hostile_") as name,
        closing(Monitor(domain)) as monitor,
    ):
        folder = Path(name)
        nodes = {node: _start(node, domain, folder / "one") for node in MODULES}
        wrong = _until_nominal(monitor, "before")
        nodes[victim].kill()
        nodes[victim].wait()
        time.sleep(0.5)
        nodes[victim] = _start(victim, domain, folder / "two")
        wrong = wrong or _until_nominal(monitor, f"after {victim} was started again")
        for process in nodes.values():
            process.send_signal(signal.SIGINT)
        _, left = psutil.wait_procs(nodes.values(), TIMEOUT_S)
        wrong += [f"{node} ended with {p.poll()}" for node, p in nodes.items() if p.poll() != 0]
        for hanging in left:
            hanging.kill()
        if not open_bag(folder / ("two" if victim == "recorder" else "one")).finished:
            wrong.append("the bag was not closed")
    return wrong


def _start(node: str, domain: int, bag: Path) -> psutil.Popen:
    options = ["--ros-args", "-p", f"bag:={bag}"] if node == "recorder" else []
    return psutil.Popen(
        [sys.executable, "-m", MODULES[node], *options],
        env={**DEFAULTS, **os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _until_nominal(monitor: Monitor, when: str) -> list[str]:
    """Wait until all four nodes are well and simulated time goes on."""
    monitor.modes.clear()
    until, reached, modes = time.monotonic() + LONGEST_S, 0.0, list[str]()
    while time.monotonic() < until:
        monitor.poll()
        modes = [monitor.modes.get(f"{node}_node", "silent") for node in MODULES]
        if any(mode != "nominal" for mode in modes):
            reached = monitor.simulated_s
        elif monitor.simulated_s > reached + FLOWN_S:
            return []
        time.sleep(0.02)
    return [f"{when}: {modes} at {monitor.simulated_s:.2f} s"]


def attacks() -> Iterator[tuple[str, Attack]]:
    """Yield each with its name."""
    for phase in PHASES:
        for victim in (*MODULES, "fly"):
            for name, number in SIGNALS.items():
                if (phase, victim) != ("landing", "plant"):  # it has ended by then
                    yield f"{name} {victim} while {phase}", partial(kill, victim, phase, number)
    for node in MODULES:
        yield f"restart {node}", partial(restart, node)


@click.command()
@click.option("--only", default="", metavar="TEXT", help="Attacks whose name has TEXT.")
@click.option("--list", "as_list", is_flag=True, help="Name the attacks, carry out none.")
def main(only: str, as_list: bool) -> None:
    r"""Attack flights on the real graph and see that none is harmed without a word.

    After each: the flight is over, with a report or with its reason in one line; its bag is closed
    and every row of it whole; no process is left; and the domain can be flown in again. Exit
    code 1: that was not so somewhere. All of it takes ten minutes or more.
    """
    chosen = [(name, attack) for name, attack in attacks() if only in name]
    harmed = 0
    for name, attack in chosen if not as_list else ():
        with ros_domain() as domain:
            pass  # a free one, for the flight to take
        begun = time.monotonic()
        wrong = attack(domain)
        harmed += bool(wrong)
        seconds = time.monotonic() - begun
        click.echo(f"{'HARMED' if wrong else 'ok':6} {seconds:5.1f} s: {name}")
        for text in wrong:
            click.echo(f"       {text}")
    click.echo("\n".join(n for n, _ in chosen) if as_list else f"{len(chosen)}, {harmed} harmed")
    sys.exit(harmed > 0)


if __name__ == "__main__":
    main(prog_name="python tools/hostile")
