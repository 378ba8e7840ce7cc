"""Programs that are forked from a loaded process."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Iterator
from pathlib import Path
from typing import IO

import psutil
import pytest

from space_robot.flight.graph.node_server import ForkedProcess, Program, node_server
from space_robot.flight.graph.processes import NodeProcess

TIMEOUT_S = 60.0
PROGRAM = """
import os, sys, time

def main():
    print(sys.argv[1:], os.environ["WORD"], "HOME" in os.environ, os.getcwd(), flush=True)
    print(os.getsid(0) == os.getpid(), file=sys.stderr, flush=True)
    verb, = sys.argv[1:]
    if verb == "wait":
        sys.stdin.buffer.raw.read()
        print("closed", flush=True)
    sys.exit(verb)
"""


@pytest.fixture
def program(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[IO[bytes]]:
    """A module `said` that can be imported, in the current folder; gives a file for its output."""
    (tmp_path / "said.py").write_text(PROGRAM)
    monkeypatch.chdir(tmp_path)
    with tempfile.TemporaryFile() as output:
        yield output


def started(output: IO[bytes], verb: str) -> ForkedProcess:
    environment = {"WORD": "a word", "PYTHONPATH": str(Path.cwd())}
    return ForkedProcess(Program("said", [verb]), output.fileno(), environment)


def ended(process: ForkedProcess) -> int:
    until = time.monotonic() + TIMEOUT_S
    while (code := process.poll()) is None:
        assert time.monotonic() < until
        time.sleep(0.005)
    return code


def text(output: IO[bytes]) -> list[str]:
    output.seek(0)
    return output.read().decode().splitlines()


def test_it_has_arguments_environment_folder_and_session(program: IO[bytes]) -> None:
    process = started(program, "go")
    assert ended(process) == 1  # as Python ends for sys.exit("go")
    assert text(program) == [f"['go'] a word False {Path.cwd()}", "True", "go"]
    process.close()


def test_its_standard_input_ends_with_the_starters_end(program: IO[bytes]) -> None:
    process = started(program, "wait")
    assert process.poll() is None
    process.close()
    assert ended(process) == 1
    assert text(program)[-2:] == ["closed", "wait"]


def test_a_signal_right_after_the_start_is_not_lost() -> None:
    for _ in range(5):
        node = NodeProcess("plant", Program("time", []), os.environ)
        node.signal(signal.SIGTERM)
        until = time.monotonic() + TIMEOUT_S
        while node.exit_code is None:
            assert time.monotonic() < until
        assert node.exit_code in (-signal.SIGTERM, 1)  # 1: `time` has no main, so it was quicker
        node.stop()
        node.close()


def test_after_a_kill_of_the_server_there_is_another(program: IO[bytes]) -> None:
    first = node_server()
    process = started(program, "wait")
    os.kill(psutil.Process(process.pid).ppid(), signal.SIGKILL)
    again = started(program, "go")
    assert node_server() is not first
    assert process.poll() == -signal.SIGKILL  # nobody knows
    assert ended(again) == 1
    process.close()
    again.close()


def test_the_current_folder_is_not_searched_for_modules(tmp_path: Path) -> None:
    (tmp_path / "numpy.py").write_text("raise SystemExit('imported from the current folder')")
    code = (
        "from space_robot.flight.graph.node_server import *\n"
        "import sys, time\n"
        "process = ForkedProcess(Program('said', []), 1, {})\n"
        "while process.poll() is None: time.sleep(0.01)\n"
    )
    done = subprocess.run(
        [sys.executable, "-c", f"import sys; sys.path.pop(0)\n{code}"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "No module named 'said'" in done.stdout + done.stderr
    assert "current folder" not in done.stdout + done.stderr
