"""Commands that are ended by a signal: soon, in one line, with nothing left behind."""

from __future__ import annotations

import contextlib
import ctypes
import os
import signal
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import psutil
import pytest

from space_robot.processes.interruption import (
    Interrupted,
    handled_signals,
    not_lost_in_callbacks,
    raising_signals,
)

COMMAND = [sys.executable, "-m", "space_robot.cli.main"]
LONG = ["--duration", "60", "--jobs", "2"]


def _workers(pid: int) -> list[psutil.Process]:
    """The processes that a reproduction has started, but for the one that compiles, before."""
    found = []
    for child in psutil.Process(pid).children(recursive=True):
        with contextlib.suppress(psutil.NoSuchProcess):  # it has just ended
            if "run_module" not in " ".join(child.cmdline()):
                found.append(child)
    return found


def _processor_s(process: psutil.Process) -> float:
    with contextlib.suppress(psutil.NoSuchProcess):
        return float(process.cpu_times().user)
    return 0.0


@contextlib.contextmanager
def _reproducing(folder: Path) -> Iterator[tuple[subprocess.Popen[str], list[psutil.Process]]]:
    """A reproduction at work, and its two workers."""
    process = subprocess.Popen(
        [*COMMAND, "reproduce", *LONG, "--out", str(folder / "out")],
        stdout=subprocess.PIPE,
        stderr=subprocess.PIPE,
        text=True,
        start_new_session=True,
        env={**os.environ, "TMPDIR": str(folder)},
        preexec_fn=lambda: signal.signal(signal.SIGHUP, signal.SIG_DFL),  # as not under nohup
    )
    workers: list[psutil.Process] = []
    try:
        until = time.monotonic() + 120.0
        while sum(_processor_s(worker) > 0.2 for worker in workers) < 2:
            assert time.monotonic() < until
            assert process.poll() is None, process.communicate()
            time.sleep(0.05)
            workers = _workers(process.pid)
        yield process, workers
    finally:
        for survivor in [psutil.Process(process.pid), *workers] if process.poll() is None else []:
            survivor.kill()
        process.communicate()


@pytest.mark.parametrize("number", [signal.SIGINT, signal.SIGTERM])
def test_reproduction_is_ended_in_one_line_with_nothing_left(
    tmp_path: Path, number: signal.Signals
) -> None:
    with _reproducing(tmp_path) as (process, workers):
        os.killpg(process.pid, number)  # as the terminal does
        begin = time.monotonic()
        output, errors = process.communicate(timeout=30)
        assert process.returncode == 128 + number
        assert errors.strip().splitlines()[-1] == f"space-robot: stopped by {number.name}"
        assert "Traceback" not in output + errors
        assert not any(worker.is_running() for worker in workers)
        assert not list(tmp_path.iterdir())
        assert time.monotonic() - begin < 20.0  # it was 41 s; it is 1


def test_workers_end_with_a_killed_reproduction(tmp_path: Path) -> None:
    with _reproducing(tmp_path) as (process, workers):
        process.kill()
        gone, alive = psutil.wait_procs(workers, timeout=60)
        for worker in alive:
            worker.kill()
        assert len(gone) == len(workers) >= 2  # and what forks them


@pytest.mark.parametrize(
    ("number", "code"),
    [(signal.SIGHUP, 129), (signal.SIGINT, 130), (signal.SIGQUIT, 131), (signal.SIGTERM, 143)],
)
@pytest.mark.parametrize("default", [signal.SIG_DFL, signal.SIG_IGN])
def test_signals_are_raised_once_and_put_back(
    number: signal.Signals, code: int, default: signal.Handlers
) -> None:
    """Also where a shell ignores them for what it starts in the background."""
    if number == signal.SIGHUP and default is signal.SIG_IGN:
        return  # nohup
    original = signal.signal(number, default)
    try:
        with raising_signals():
            with pytest.raises(Interrupted, match=f"stopped by {number.name}") as raised:
                signal.raise_signal(number)
            signal.raise_signal(signal.SIGINT)  # again, from `timeout` or an impatient hand
        assert raised.value.exit_code == code
        assert signal.getsignal(number) is default
    finally:
        signal.signal(number, original)


@pytest.mark.parametrize("error", [None, RuntimeError("no compiled object yet")])
def test_a_signal_in_a_callback_of_c_is_raised_after_it(error: RuntimeError | None) -> None:
    @ctypes.CFUNCTYPE(None)
    def callback() -> None:
        signal.raise_signal(signal.SIGTERM)

    def compile_kernels() -> None:
        with not_lost_in_callbacks():
            callback()
            if error:
                raise error

    with raising_signals(), pytest.raises(Interrupted, match="stopped by SIGTERM"):
        compile_kernels()


def test_other_errors_beside_callbacks_stay() -> None:
    with pytest.raises(RuntimeError, match="another"), not_lost_in_callbacks():
        raise RuntimeError("another")


def test_nohup_is_respected() -> None:
    before = signal.signal(signal.SIGHUP, signal.SIG_IGN)
    try:
        with handled_signals(lambda number, frame: None):
            assert signal.getsignal(signal.SIGHUP) is signal.SIG_IGN
    finally:
        signal.signal(signal.SIGHUP, before)
