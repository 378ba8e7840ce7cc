"""A process that ends with its starter, however that one ends; also through one in between."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from space_robot_msgs_py.ros import lifeline

HOLDING = """
import signal, sys, time
from space_robot_msgs_py.ros.lifeline import hold_to_standard_input
if sys.argv[1] == "deaf":
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
hold_to_standard_input()
print("ready", flush=True)
time.sleep(60)
"""
STARTER = """
import os, subprocess, sys, time
from space_robot_msgs_py.ros import lifeline
child = subprocess.Popen(
    sys.argv[1:], stdin=subprocess.PIPE, env={**os.environ, **lifeline.held()},
    start_new_session=True,
)
time.sleep(60)
"""
WRAPPER = "import subprocess, sys; sys.exit(subprocess.Popen(sys.argv[1:]).wait())"
"""As ``ros2 run``: it passes on its standard input, and nothing else."""


def _start(*between: str, manner: str = "good") -> tuple[subprocess.Popen[str], psutil.Process]:
    """A starter, and the process that holds to it."""
    holding = [*between, sys.executable, "-c", HOLDING, manner]
    starter = subprocess.Popen(
        [sys.executable, "-c", STARTER, *holding], stdout=subprocess.PIPE, text=True
    )
    assert starter.stdout is not None
    assert starter.stdout.readline() == "ready\n"
    return starter, psutil.Process(starter.pid).children(recursive=True)[-1]


@pytest.mark.parametrize("between", [(), (sys.executable, "-c", WRAPPER)], ids=["direct", "ros2"])
def test_killed_starter_takes_its_process_with_it(between: tuple[str, ...]) -> None:
    starter, held = _start(*between)
    starter.kill()
    starter.communicate(timeout=60)
    held.wait(timeout=10)


def test_stopped_process_ends_when_it_goes_on() -> None:
    starter, held = _start()
    held.suspend()
    starter.kill()
    starter.wait()
    with pytest.raises(psutil.TimeoutExpired):
        held.wait(timeout=0.3)
    held.resume()
    held.wait(timeout=10)
    starter.communicate()


def test_deaf_process_is_killed(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(lifeline, "TIMEOUT_S", 0.1)
    pid = os.fork()
    if not pid:
        signal.signal(signal.SIGTERM, signal.SIG_IGN)
        read_end, write_end = os.pipe()
        lifeline.hold_to(read_end)
        os.close(write_end)
        time.sleep(60)
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(pid, 0)[1]) == signal.SIGKILL


def test_standard_input_is_left_alone_unless_it_is_a_lifeline(tmp_path: Path) -> None:
    """A node by hand reads /dev/null or a terminal; its end means nothing."""
    environment = {key: value for key, value in os.environ.items() if key != lifeline.VARIABLE}
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDING, "good"],
        stdin=subprocess.DEVNULL,
        stdout=subprocess.PIPE,
        text=True,
        env=environment,
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    with pytest.raises(subprocess.TimeoutExpired):
        process.wait(0.5)
    process.kill()
    process.communicate()
