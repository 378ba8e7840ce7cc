"""Long flights of `simulate`: flat memory, told what does not fit, ended when asked to."""

from __future__ import annotations

import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest
from flights import COMMAND, ended, ros_environment, simulated, space_robot_here

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.processes import memory
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError

PEAK = """
import resource, sys
from space_robot_msgs_py.bag import blocks
blocks.BLOCK_TICKS = 4000
from space_robot.cli.main import cli
cli.main(sys.argv[1:], standalone_mode=False)
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss)
"""
"""The command, with blocks of 2 s and so short flights that are long."""


def peak(*arguments: str) -> int:
    done = subprocess.run(
        [sys.executable, "-c", PEAK, "simulate", *arguments],
        capture_output=True,
        text=True,
        timeout=150,
        check=True,
        env=ros_environment(),
    )
    return int(done.stdout.splitlines()[-1])


def test_memory_does_not_grow_with_the_flight(tmp_path: Path) -> None:
    """Many blocks need what two do; a log of the whole would need a fifth more."""
    two = peak("--duration", "4", "--bag", str(tmp_path / "two"))
    many = peak("--duration", "16", "--bag", str(tmp_path / "many"))
    assert many < 1.08 * two


def test_the_longest_flight_flies_and_can_be_interrupted(tmp_path: Path) -> None:
    """It ended in a traceback before its first tick."""
    bag = tmp_path / "bag"
    command = [*COMMAND, "simulate", "--duration", "1e6", "--bag", str(bag)]
    with (
        subprocess.Popen(
            command, stderr=subprocess.PIPE, text=True, env=ros_environment()
        ) as process,
        ended(process),
    ):
        while not (bag / "bag_0.mcap").exists() or (bag / "bag_0.mcap").stat().st_size < 1_000_000:
            assert process.poll() is None
            time.sleep(0.02)
        process.send_signal(signal.SIGINT)
        _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert read_flight(bag).unfinished == ""
    assert not list(bag.glob("*.part"))


def test_a_whole_flight_in_memory_that_does_not_fit_is_refused() -> None:
    """Of those who need it whole: `stability`, and Python."""
    with pytest.raises(InputError, match=r"duration 1e\+06 s: the whole flight .* GB are free"):
        simulated(duration=1e6)
    result = space_robot_here("stability", "--duration", "1e6")
    assert result.returncode == 2
    assert result.stderr.splitlines()[-1].startswith("space-robot: error: duration 1e+06 s")
    assert "Traceback" not in result.stderr


def test_memory_that_is_there_is_used(monkeypatch: pytest.MonkeyPatch) -> None:
    plan = FlightPlan(duration=0.01)
    monkeypatch.setattr(memory, "available_bytes", lambda: 20 * 1000)
    simulate(Flight(resolve(plan)))
    monkeypatch.setattr(memory, "available_bytes", lambda: 20 * 800)
    with pytest.raises(InputError, match="fly a shorter one"):
        simulate(Flight(resolve(plan)))


def test_what_is_available_is_what_psutil_says() -> None:
    told = psutil.virtual_memory().available
    assert memory.available_bytes() == pytest.approx(told, rel=0.2)
