"""Processes of nodes: they end with their starter, and search neither folder nor home of users."""

from __future__ import annotations

import json
import os
import signal
import subprocess
import sys
import time
from pathlib import Path

import psutil
import pytest

from space_robot_msgs_py.ros import lifeline
from space_robot_msgs_py.ros.process_environment import DEFAULTS, defaults
from space_robot_msgs_py.ros.run_module import HERE, clean_environment, module_command

HOLDING = """
import time
from space_robot_msgs_py.ros.lifeline import hold_to_standard_input
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
END_S = 30


@pytest.mark.parametrize(
    ("between", "is_stopped"),
    [((), True), ((sys.executable, "-c", WRAPPER), False)],
    ids=["stopped", "ros2 run"],
)
def test_a_killed_starter_takes_its_process_with_it(
    between: tuple[str, ...], is_stopped: bool
) -> None:
    """One that was stopped then ends when it goes on."""
    holding = [*between, sys.executable, "-c", HOLDING]
    starter = subprocess.Popen(
        [sys.executable, "-c", STARTER, *holding], stdout=subprocess.PIPE, text=True
    )
    assert starter.stdout is not None
    assert starter.stdout.readline() == "ready\n"
    held = psutil.Process(starter.pid).children(recursive=True)[-1]
    if is_stopped:
        held.suspend()
    starter.kill()
    starter.wait()
    if is_stopped:
        assert held.status() == psutil.STATUS_STOPPED
        held.resume()
    held.wait(timeout=END_S)
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


def test_standard_input_is_left_alone_unless_it_is_a_lifeline(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A node by hand reads /dev/null or a terminal; its end means nothing."""
    held: list[int] = []
    monkeypatch.setattr(lifeline, "hold_to", held.append)
    monkeypatch.delenv(lifeline.VARIABLE, raising=False)
    lifeline.hold_to_standard_input()
    assert held == []
    for name, value in lifeline.held().items():
        monkeypatch.setenv(name, value)
    lifeline.hold_to_standard_input()
    assert len(held) == 1


# Modules as programs

SHOW = 'import json, sys; print(json.dumps({"argv": sys.argv[1:], "path": sys.path}))'


@pytest.fixture
def folders(tmp_path: Path) -> tuple[Path, Path]:
    """One with modules of the names of others, as users have them; one with a program."""
    shadows, program = tmp_path / "shadows", tmp_path / "programs"
    for folder in (shadows, program):
        folder.mkdir()
    for name in ("yaml", "queue", "numpy", "space_robot_sim", "runpy"):
        (shadows / f"{name}.py").write_text("raise SystemExit('ran the code of this folder')\n")
    (program / "show.py").write_text(f"import queue, yaml, numpy, space_robot_sim\n{SHOW}\n")
    return shadows, program


@pytest.mark.parametrize("has_empty_entries", [False, True])
def test_the_current_folder_is_not_searched(
    folders: tuple[Path, Path], monkeypatch: pytest.MonkeyPatch, has_empty_entries: bool
) -> None:
    """Nor where ``export PYTHONPATH=$MINE:$PYTHONPATH`` has left an empty entry behind."""
    shadows, program = folders
    ours = [entry for entry in os.environ.get("PYTHONPATH", "").split(os.pathsep) if entry]
    path = [str(program), *ours]
    path = ["", *path, ""] if has_empty_entries else path
    monkeypatch.setenv("PYTHONPATH", os.pathsep.join(path))
    done = subprocess.run(
        module_command("show", "-p", "a:=[1, 2]"),
        cwd=shadows,
        env={**os.environ, **(clean_environment() if has_empty_entries else {})},
        capture_output=True,
        text=True,
        check=True,
    )
    found = json.loads(done.stdout)
    assert found["argv"] == ["-p", "a:=[1, 2]"]
    assert not {str(shadows), "", HERE} & {*found["path"]}
    assert str(program) in found["path"]


def test_same_tree_is_found_where_it_is_not_installed(tmp_path: Path) -> None:
    module = module_command("space_robot_msgs_py.ros.lifeline")
    subprocess.run([sys.executable, "-I", "-S", *module[1:]], cwd=tmp_path, check=True)


# Homes

HOMES = ("HOME", "ROS_HOME", "ROS_LOG_DIR")


@pytest.mark.parametrize("name", HOMES)
def test_who_has_a_home_keeps_it(monkeypatch: pytest.MonkeyPatch, name: str) -> None:
    for other in HOMES:
        monkeypatch.delenv(other, raising=False)
    monkeypatch.setenv(name, "/somewhere")
    assert defaults() == DEFAULTS


def test_ros_starts_without_a_home() -> None:
    """ROS itself wants a folder for its log files."""
    pytest.importorskip("rclpy")
    environment = {k: v for k, v in os.environ.items() if k not in HOMES}
    program = (
        "from space_robot.flight.graph.temporary_node import TemporaryNode;"
        f"TemporaryNode('nobody', {os.getpid() % 100}).leave()"
    )
    result = subprocess.run(
        [sys.executable, "-c", program],
        check=False,
        capture_output=True,
        text=True,
        env={**environment, "HOME": ""},
    )
    assert result.returncode == 0, result.stderr
