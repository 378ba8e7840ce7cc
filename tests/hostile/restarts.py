"""Nodes started by hand, as with `ros2 run`: one dies and is started again, the graph goes on."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from contextlib import closing
from pathlib import Path

from trial import NODES, Verdict

from space_robot.flight.graph.monitor import Monitor
from space_robot.flight.graph.processes import MODULES
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.ros.process_environment import DEFAULTS

TIMEOUT_S = 15.0
FLOWN_S = 0.2
"""Simulated time after a restart that shows that the loop is closed again."""


def restarted(victim: str) -> Callable[[int], list[Verdict]]:
    """Kill ``victim`` in flight and start it again: the loop must close by itself."""

    def attack(domain: int) -> list[Verdict]:
        begin = time.monotonic()
        with (
            tempfile.TemporaryDirectory(prefix="hostile_") as folder,
            closing(Monitor(domain)) as monitor,
        ):
            nodes = {name: _start(name, domain, Path(folder) / "one") for name in NODES}
            wrong = _until_nominal(monitor, "before")
            nodes[victim].kill()
            nodes[victim].wait()
            time.sleep(0.5)
            nodes[victim] = _start(victim, domain, Path(folder) / "two")
            wrong = wrong or _until_nominal(monitor, f"after {victim} was started again")
            for name in NODES:
                nodes[name].send_signal(signal.SIGINT)
            for name, node in nodes.items():
                try:
                    if code := node.wait(TIMEOUT_S):
                        wrong.append(f"{name} ended with {code}")
                except subprocess.TimeoutExpired:
                    wrong.append(f"{name} does not end")
                    node.kill()
            bag = Path(folder) / ("two" if victim == "recorder" else "one")
            if not open_bag(bag).finished:
                wrong.append("the bag was not closed")
        return [Verdict(f"{victim} restarted", None, time.monotonic() - begin, "", wrong)]

    return attack


def _start(name: str, domain: int, bag: Path) -> subprocess.Popen[bytes]:
    options = ["--ros-args", "-p", f"bag:={bag}"] if name == "recorder" else []
    return subprocess.Popen(
        [sys.executable, "-m", MODULES[name], *options],
        env={**DEFAULTS, **os.environ, "ROS_DOMAIN_ID": str(domain)},
        stdout=subprocess.DEVNULL,
        stderr=subprocess.DEVNULL,
    )


def _until_nominal(monitor: Monitor, when: str) -> list[str]:
    """Wait until all four nodes are well and simulated time goes on."""
    monitor.modes.clear()
    until, reached = time.monotonic() + TIMEOUT_S, 0.0
    while time.monotonic() < until:
        monitor.poll()
        modes = [monitor.modes.get(f"{name}_node", "silent") for name in NODES]
        if any(mode != "nominal" for mode in modes):
            reached = monitor.simulated_s
        elif monitor.simulated_s > reached + FLOWN_S:
            return []
        time.sleep(0.02)
    return [f"{when}: {dict(zip(NODES, modes, strict=True))} at {monitor.simulated_s:.2f} s"]
