"""One flight under attack: started as a user would, watched from outside, judged by the rest."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import tempfile
import time
import uuid
from collections.abc import Callable
from pathlib import Path
from typing import Any, NamedTuple

from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process_environment import DEFAULTS

FOLDER = Path(__file__).resolve().parent
MARK = "SPACE_ROBOT_HOSTILE_TRIAL"
"""Environment variable by which the processes of a trial are found, whoever started them."""
LONGEST_S = 100.0
LEAVING_S = 5.0
NODES = ("plant", "controller", "mission", "recorder")


class Verdict(NamedTuple):
    """What became of a trial; ``wrong`` is empty if all is as it should be."""

    name: str
    exit_code: int | None
    seconds: float
    said: str
    wrong: list[str]


class Trial:
    """A flight of a given length in a domain of its own, and everything started beside it."""

    def __init__(self, name: str, domain: int, *options: str, duration: float = 1.0) -> None:
        self.name, self.domain = name, domain
        self._ticks = round(duration / 0.0005)
        self._mark = uuid.uuid4().hex
        self._folder = tempfile.TemporaryDirectory(prefix="hostile_")
        self.bag = Path(self._folder.name) / "bag"
        self._options = ["--duration", str(duration), "--bag", str(self.bag), *options]
        self._began = 0.0
        self._others: list[subprocess.Popen[str]] = []
        self.process: subprocess.Popen[str]

    def start(self) -> Trial:
        """Start the flight."""
        self._began = time.monotonic()
        self.process = self.run("-m", "space_robot.cli.main", "fly", "--json", *self._options)
        return self

    def run(self, *arguments: str) -> subprocess.Popen[str]:
        """Start Python with ``arguments`` in the trial's domain."""
        environment = {
            **DEFAULTS,
            **os.environ,
            "ROS_DOMAIN_ID": str(self.domain),
            MARK: self._mark,
        }
        return subprocess.Popen(
            [sys.executable, *arguments],
            env=environment,
            text=True,
            stdout=subprocess.PIPE,
            stderr=subprocess.PIPE,
        )

    def publish_foreign(self, topic: str, kind: str, rate_hz: float) -> None:
        """Let somebody else publish on a topic, from now to the trial's end."""
        process = self.run(str(FOLDER / "foreign_publisher.py"), topic, kind, str(rate_hz))
        assert process.stdout is not None
        process.stdout.readline()
        self._others.append(process)

    def wait(self, condition: Callable[[], object], longest_s: float = 60.0) -> bool:
        """Wait until something holds, or the flight has ended; whether it holds."""
        until = time.monotonic() + longest_s
        while self.process.poll() is None and time.monotonic() < until:
            if condition():
                return True
            time.sleep(0.005)
        return bool(condition())

    def node(self, name: str) -> int | None:
        """The process of a node, if there is one."""
        for pid in self._left():
            if _read(pid, "cmdline").startswith(f"{name}_node"):
                return pid
        return None

    def recorded_bytes(self) -> int:
        """Size of the bag so far."""
        return sum(file.stat().st_size for file in self.bag.glob("*.mcap"))

    def end(self, may_lose: bool = False, must_fly: bool = False) -> Verdict:
        """Wait for the flight's end and judge.

        ``may_lose``: the recorder itself was killed, so the bag may lack its end; ``must_fly``:
        nothing that was done is a reason not to fly to the end.
        """
        wrong: list[str] = []
        try:
            output, said = self.process.communicate(timeout=LONGEST_S)
        except subprocess.TimeoutExpired:
            wrong.append(f"not over after {LONGEST_S:.0f} s")
            self.process.kill()
            output, said = self.process.communicate()
        seconds, code = time.monotonic() - self._began, self.process.returncode
        for other in self._others:
            if other.poll() is not None:
                wrong.append("the attack itself has ended before the flight")
            other.kill()
            other.communicate()
        until = time.monotonic() + LEAVING_S
        while (left := self._left()) and time.monotonic() < until:
            time.sleep(0.05)
        wrong += [f"left behind: {_read(pid, 'cmdline')[:120]}" for pid in left]
        for pid in left:
            os.kill(pid, signal.SIGKILL)
        if "Traceback" in said or "Traceback" in output:
            wrong.append("traceback: " + said[said.index("Traceback") :][-300:])
        wrong += self._judge_words(code, output, said, must_fly)
        wrong += self._judge_bag(code, may_lose)
        lines = [line for line in said.strip().splitlines() if "error" in line]
        self._folder.cleanup()
        return Verdict(self.name, code, seconds, (lines or [""])[-1][:200], wrong)

    def _judge_words(self, code: int, output: str, said: str, must_fly: bool) -> list[str]:
        if code == -signal.SIGKILL:  # it was killed itself
            return []
        if code == 0:
            report: dict[str, Any] = json.loads(output)
            lost = {k: v for k, v in report["lost"].items() if v}
            if lost or report["damage"] or report["ticks"] != self._ticks:
                return [f"exit code 0, but {report['ticks']} ticks, {lost}, {report['damage']}"]
            return []
        wrong = [f"did not fly: exit code {code}"] if must_fly else []
        reasons = said.partition("space-robot: error:")[2].strip()
        if code not in (1, 2, 130, 143) or not reasons:
            wrong.append(f"exit code {code} without a reason: {said.strip()[-300:]!r}")
        return wrong

    def _judge_bag(self, code: int, may_lose: bool) -> list[str]:
        if not self.recorded_bytes():
            return [] if code else ["exit code 0 without a bag"]
        try:
            finished = open_bag(self.bag).finished
        except SpaceRobotError as error:
            return [f"bag: {error}"]
        wrong = [] if finished or may_lose else ["the bag was not closed"]
        try:
            log = read_flight(self.bag)
        except SpaceRobotError as error:
            none_flown = "no messages on" in str(error) or "not one tick" in str(error)
            return wrong if none_flown else [*wrong, f"bag: {error}"]
        if not log.whole.all():
            wrong.append(f"{(~log.whole).sum()} of {log.ticks} rows of the bag are not whole")
        return wrong

    def _left(self) -> list[int]:
        """Processes of this trial that live, the flight's command itself left out."""
        found = []
        for entry in Path("/proc").iterdir():
            if entry.name.isdecimal() and int(entry.name) != self.process.pid:
                pid = int(entry.name)
                if f"{MARK}={self._mark}" in _read(pid, "environ") and _lives(pid):
                    found.append(pid)
        return found


def _read(pid: int, name: str) -> str:
    try:
        return Path(f"/proc/{pid}/{name}").read_bytes().decode(errors="replace").replace("\0", " ")
    except OSError:
        return ""


def _lives(pid: int) -> bool:
    return ") Z" not in _read(pid, "stat") and bool(_read(pid, "cmdline"))
