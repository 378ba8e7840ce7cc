"""Locks of topics, nodes and domains: who holds them, and that they never meet."""

from __future__ import annotations

import os
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_msgs_py.ros import lifeline
from space_robot_msgs_py.ros.locks import (
    FileLock,
    HeldError,
    Holder,
    commands_in,
    domain_lock,
    newest_node,
    node_lock,
    nodes_in,
    topic_lock,
)

HOLDER = """
import sys, time
from pathlib import Path
from space_robot_msgs_py.ros.locks import FileLock
lock = FileLock(Path(sys.argv[1]), "plant_node")
print("ready", flush=True)
time.sleep(60)
"""
NAMES = st.lists(st.from_regex(r"[a-z][a-z0-9_]{0,5}", fullmatch=True), min_size=1, max_size=3)
KINDS: list[Callable[[int, str], Path]] = [topic_lock, node_lock, domain_lock]


@pytest.fixture(autouse=True)
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Locks of the test's own."""
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
    return tmp_path


def test_killed_holder_is_named_and_leaves_the_lock_at_once() -> None:
    path = node_lock(42, "/plant_node")
    process = subprocess.Popen(
        [sys.executable, "-c", HOLDER, str(path)],
        stdout=subprocess.PIPE,
        text=True,
        env={**os.environ, lifeline.VARIABLE: "1234"},
    )
    assert process.stdout is not None
    assert process.stdout.readline() == "ready\n"
    holder = Holder(f"plant_node (pid {process.pid})", starter=1234)
    with pytest.raises(HeldError, match=r"plant_node \(pid") as refused:
        FileLock(path, "another")
    assert refused.value.holder == holder
    assert nodes_in(42) == [holder]
    assert nodes_in(4) == nodes_in(421) == []
    process.kill()
    process.communicate()
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
def test_every_topic_and_node_of_every_domain_has_its_own_lock(
    one: tuple[Callable[[int, str], Path], int, list[str]],
    other: tuple[Callable[[int, str], Path], int, list[str]],
) -> None:
    paths = [kind(domain, "/" + "/".join(name)) for kind, domain, name in (one, other)]
    assert (paths[0] == paths[1]) == (one == other)


def test_the_node_that_began_last(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(tempfile, "gettempdir", lambda: str(tmp_path))
    assert newest_node("plant_node") is None
    begun = [(7, "/plant_node"), (12, "/fleet/sat1/plant_node"), (3, "/own_plant_node")]
    held = []
    for age, (domain, name) in enumerate(begun):
        path = node_lock(domain, name)
        held.append(FileLock(path, "plant_node"))
        os.utime(path, (0, age))
    assert newest_node("plant_node") == (12, "/fleet/sat1")
    assert newest_node("plant_node", "/") == (7, "/")
    assert newest_node("plant_node", "/sat1") is None
    held[1].release()
    assert newest_node("plant_node") == (7, "/")
    for lock in (held[0], held[2]):
        lock.release()
    assert newest_node("plant_node") is None
