"""Processes of nodes: they end with their starter, search no folder of users, hold locks."""

from __future__ import annotations

import ctypes
import json
import os
import signal
import subprocess
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import psutil
import pytest
from command import run_program
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.ros import process
from space_robot_msgs_py.ros.locks import (
    FileLock,
    HeldError,
    Holder,
    commands_in,
    domain_lock,
    living_nodes,
    node_lock,
    nodes_in,
)
from space_robot_msgs_py.ros.process import (
    DEFAULTS,
    FOLDER,
    clean_environment,
    defaults,
    module_command,
)

HOLDING = """
import time
from space_robot_msgs_py.ros.process import hold_to_standard_input
hold_to_standard_input()
print("ready", flush=True)
time.sleep(60)
"""
STARTER = """
import os, subprocess, sys, time
from space_robot_msgs_py.ros.process import lifeline
child = subprocess.Popen(
    sys.argv[1:], stdin=subprocess.PIPE, env={**os.environ, **lifeline()},
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
        while held.status() != psutil.STATUS_STOPPED:
            time.sleep(0.001)
    starter.kill()
    starter.wait()
    if is_stopped:
        held.resume()
    held.wait(timeout=END_S)
    starter.communicate()


def hangs(*_: object) -> None:
    """In C, with Python's lock, so that no other thread of Python goes on."""
    ctypes.PyDLL(None).sleep(60)


@pytest.mark.parametrize("ending", [signal.SIG_IGN, hangs], ids=["deaf", "hanging"])
def test_process_that_does_not_end_is_killed(monkeypatch: pytest.MonkeyPatch, ending: Any) -> None:
    monkeypatch.setattr(process, "TIMEOUT_S", 0.1)
    pid = os.fork()
    if not pid:
        signal.signal(signal.SIGTERM, ending)
        read_end, write_end = os.pipe()
        process.hold_to(read_end)
        os.close(write_end)
        time.sleep(60)
        os._exit(0)
    assert os.WTERMSIG(os.waitpid(pid, 0)[1]) == signal.SIGALRM


def test_standard_input_is_left_alone_unless_it_is_a_lifeline(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A node by hand reads /dev/null or a terminal; its end means nothing."""
    held: list[int] = []
    monkeypatch.setattr(process, "hold_to", held.append)
    monkeypatch.delenv(process.LIFELINE, raising=False)
    process.hold_to_standard_input()
    assert held == []
    for name, value in process.lifeline().items():
        monkeypatch.setenv(name, value)
    process.hold_to_standard_input()
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
    assert not {str(shadows), "", FOLDER} & {*found["path"]}
    assert str(program) in found["path"]


def test_same_tree_is_found_where_it_is_not_installed(tmp_path: Path) -> None:
    module = module_command("space_robot_msgs_py.simulated_time")
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
        "from space_robot.flight.graph.node_services import TemporaryNode;"
        f"TemporaryNode('nobody', {os.getpid() % 100}).leave()"
    )
    result = run_program([sys.executable, "-c", program], env={**environment, "HOME": ""})
    assert result.returncode == 0, result.stderr


# Locks of topics, nodes and domains

HOLDER = """
import sys, time
from pathlib import Path
from space_robot_msgs_py.ros.locks import FileLock
lock = FileLock(Path(sys.argv[1]), "plant_node")
print("ready", flush=True)
time.sleep(60)
"""
NAMES = st.lists(st.from_regex(r"[a-z][a-z0-9_]{0,5}", fullmatch=True), min_size=1, max_size=3)
KINDS: list[Callable[[int, str], Path]] = [node_lock, domain_lock]


@pytest.fixture(autouse=True)
def own_locks(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))


def test_killed_holder_is_named_and_leaves_the_lock_at_once() -> None:
    path = node_lock(42, "/plant_node")
    holding = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, process.LIFELINE: "1234"},
    )
    assert holding.stdout is not None
    assert holding.stdout.readline() == "ready\n"
    holder = Holder(f"plant_node (pid {holding.pid})", starter=1234)
    with pytest.raises(HeldError, match=r"plant_node \(pid") as refused:
        FileLock(path, "another")
    assert refused.value.holder == holder
    assert nodes_in(42) == [holder]
    assert nodes_in(4) == nodes_in(421) == []
    holding.kill()
    holding.communicate()
    assert nodes_in(42) == []
    FileLock(path, "another").release()


def test_nodes_and_commands_are_found_by_domain_and_namespace() -> None:
    names = ("/plant_node", "/sat1/plant_node", "/sat1/arm/plant_node", "/sat11/plant_node")
    locks = [FileLock(node_lock(7, name), name) for name in names]
    for name in names:
        namespace = name.removesuffix("/plant_node") or "/"
        assert [node.name for node in nodes_in(7, namespace)] == [f"{name} (pid {os.getpid()})"]
    places = [(7, "/"), (7, "/sat1"), (7, "/fleet/sat2"), (70, "/"), (70, "/sat1")]
    locks += [FileLock(domain_lock(*place), "space-robot") for place in places]
    assert [len(commands_in(domain)) for domain in (7, 70, 0)] == [3, 2, 0]
    for lock in locks:
        lock.release()
    assert commands_in(7) == nodes_in(7) == []


@given(
    st.tuples(st.sampled_from(KINDS), st.integers(0, 232), NAMES),
    st.tuples(st.sampled_from(KINDS), st.integers(0, 232), NAMES),
)
def test_every_node_of_every_domain_has_its_own_lock(
    one: tuple[Callable[[int, str], Path], int, list[str]],
    other: tuple[Callable[[int, str], Path], int, list[str]],
) -> None:
    paths = [kind(domain, "/" + "/".join(name)) for kind, domain, name in (one, other)]
    assert (paths[0] == paths[1]) == (one == other)


def test_the_node_that_began_last() -> None:
    assert next(living_nodes("plant_node"), None) is None
    begun = [(7, "/plant_node"), (12, "/fleet/sat1/plant_node"), (3, "/own_plant_node")]
    held = []
    for age, (domain, name) in enumerate(begun):
        path = node_lock(domain, name)
        held.append(FileLock(path, "plant_node"))
        os.utime(path, (0, age))
    assert next(living_nodes("plant_node"), None) == (12, "/fleet/sat1")
    assert next(living_nodes("plant_node", "/"), None) == (7, "/")
    assert next(living_nodes("plant_node", "/sat1"), None) is None
    held[1].release()
    assert next(living_nodes("plant_node"), None) == (7, "/")
    for lock in (held[0], held[2]):
        lock.release()
    assert next(living_nodes("plant_node"), None) is None
