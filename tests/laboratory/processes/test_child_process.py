"""A helper process: out of reach of the terminal's Ctrl-C, and gone with who has started it."""

from __future__ import annotations

import os
import signal
import subprocess
import sys

import psutil

from space_robot.processes.child_process import child_process

HELPER = [
    sys.executable,
    "-c",
    "import os, sys, time\n"
    "from space_robot_msgs_py.ros.lifeline import hold_to_standard_input\n"
    "hold_to_standard_input()\n"
    "print(os.environ.get('EXTRA', ''), flush=True)\n"
    "time.sleep(600)\n",
]
STARTER = f"""
import subprocess, time
from space_robot.processes.child_process import child_process
with child_process({HELPER!r}, stdout=subprocess.PIPE) as helper:
    helper.stdout.readline()
    print(helper.pid, flush=True)
    time.sleep(600)
"""


def test_it_has_a_session_of_its_own_and_ends_with_the_context() -> None:
    with child_process(HELPER, stdout=subprocess.PIPE, env={"EXTRA": "beside"}) as helper:
        assert helper.stdout
        assert helper.stdout.readline() == b"beside\n"
        assert os.getsid(helper.pid) == os.getpgid(helper.pid) == helper.pid
        assert helper.poll() is None
    assert helper.returncode == -signal.SIGTERM


def test_it_does_not_outlive_a_starter_that_is_killed() -> None:
    starter = subprocess.Popen([sys.executable, "-c", STARTER], stdout=subprocess.PIPE)
    with starter:
        assert starter.stdout
        helper = psutil.Process(int(starter.stdout.readline()))
        starter.kill()
        helper.wait(60)
    assert not helper.is_running()
