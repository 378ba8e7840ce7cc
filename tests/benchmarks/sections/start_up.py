"""From the command to the first tick."""

from __future__ import annotations

import subprocess
import sys
import tempfile
import time
from pathlib import Path

from space_robot.flight.graph.domain import ros_domain
from space_robot.flight.graph.monitor import Monitor
from space_robot.flight.graph.orchestrator import require_ros
from space_robot.processes.child_process import child_process
from space_robot_msgs_py.errors import FlightError
from space_robot_msgs_py.ros.run_module import module_command

from ..measure import Options, interleave, repeated
from ..result import Result, Target

HELP_ASKED = Target(0.3)
FIRST_TICK_ASKED = Target(5.0)
COMMAND = module_command("space_robot.cli.main")


def start_up(options: Options) -> list[Result]:
    """``--help`` beside an interpreter that does nothing; ``fly`` until its plant sends."""
    require_ros()
    options.progress("the command line's start")
    nothing, help_ = "python -c pass", "space-robot --help"
    seconds = interleave(
        {
            help_: repeated(lambda: _run([*COMMAND, "--help"])),
            nothing: repeated(lambda: _run([sys.executable, "-c", "pass"])),
        },
        options.batches(usual=9),
        batch_s=options.batch_s,
    )
    first_ticks: list[float] = []
    for _ in range(count := options.batches(usual=5)):
        options.progress(f"the graph's start, {len(first_ticks) + 1} of {count}")
        first_ticks.append(_first_tick_s())
    return [
        Result.timed(
            help_, "s", seconds[help_], (nothing, seconds[nothing]), options.asked(HELP_ASKED)
        ),
        Result(
            "fly: first tick after", "s", tuple(first_ticks), target=options.asked(FIRST_TICK_ASKED)
        ),
    ]


def _run(command: list[str]) -> None:
    subprocess.run(command, check=True, stdout=subprocess.DEVNULL)


def _first_tick_s() -> float:
    """From the command to the plant's first state, as another process hears it."""
    with ros_domain() as domain:
        pass  # it is free, and the flight takes it
    with tempfile.TemporaryDirectory(prefix="space_robot_bench_") as folder:
        monitor = Monitor(domain)
        begin = time.monotonic()
        command = [*COMMAND, "fly", "--duration", "1", "--bag", str(Path(folder) / "bag")]
        with child_process(
            command,
            env={"ROS_DOMAIN_ID": str(domain)},
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
        ) as flight:
            while not monitor.has_begun and flight.poll() is None:
                time.sleep(0.005)
                monitor.poll()
            first_tick = time.monotonic() - begin
            flight.wait()
        monitor.close()
    if flight.returncode != 0:
        raise FlightError(f"{' '.join(command)}: exit code {flight.returncode}")
    return first_tick
