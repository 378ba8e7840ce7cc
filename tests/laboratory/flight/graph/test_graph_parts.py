"""Parts of a graph's start and end: node server, service calls, launched nodes, what is told."""

from __future__ import annotations

import os
import signal
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from itertools import count
from pathlib import Path
from typing import IO, Any

import psutil
import pytest

from space_robot.flight.graph.following import degradation
from space_robot.flight.graph.node_names import NODE_NAMES
from space_robot.flight.graph.node_server import ForkedProcess, Program, node_server
from space_robot.flight.graph.orchestrator import LaunchedGraph
from space_robot.flight.graph.processes import TAIL_LINES, NodeProcess
from space_robot_msgs_py.ros.process import set_defaults

set_defaults()
pytest.importorskip("rclpy")

from lifecycle_msgs.srv import GetState  # noqa: E402
from rclpy.executors import SingleThreadedExecutor  # noqa: E402
from std_srvs.srv import Trigger  # noqa: E402

from space_robot.flight.graph import node_services  # noqa: E402
from space_robot.flight.graph.node_services import TemporaryNode  # noqa: E402

TIMEOUT_S = 240.0
PROGRAM = """
import os, sys

def main():
    print(os.environ["WORD"], "HOME" in os.environ, os.getcwd(), flush=True)
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


def ended(poll: Callable[[], int | None]) -> int:
    until = time.monotonic() + TIMEOUT_S
    while (code := poll()) is None:
        assert time.monotonic() < until
        time.sleep(0.005)
    return code


def test_a_program_has_arguments_environment_folder_and_session(program: IO[bytes]) -> None:
    """Its standard input ends with the starter's end."""
    process = started(program, "go")
    assert ended(process.poll) == 1  # as Python ends for sys.exit("go")
    process.close()
    process = started(program, "wait")
    assert process.poll() is None
    process.close()
    assert ended(process.poll) == 1
    program.seek(0)
    told = [f"a word False {Path.cwd()}", "True"]
    said = [*told, "go", *told, "closed", "wait"]
    assert program.read().decode().splitlines() == said


def test_a_signal_right_after_the_start_is_not_lost() -> None:
    for _ in range(3):
        node = NodeProcess("plant", Program("time", []), os.environ)
        node.signal(signal.SIGTERM)
        # 1: `time` has no main, so it was quicker
        assert ended(lambda node=node: node.exit_code) in (-signal.SIGTERM, 1)
        node.stop()
        node.close()


def test_after_a_kill_of_the_server_there_is_another(program: IO[bytes]) -> None:
    first = node_server()
    process = started(program, "wait")
    os.kill(psutil.Process(process.pid).ppid(), signal.SIGKILL)
    again = started(program, "go")
    assert node_server() is not first
    assert process.poll() == -signal.SIGKILL  # nobody knows
    assert ended(again.poll) == 1
    process.close()
    again.close()


def test_an_error_is_told_though_much_was_said_after_it() -> None:
    """In a process of several nodes the others end after the one that failed, each with a word."""
    words = "; ".join(f"print('word {k}')" for k in range(2 * TAIL_LINES))
    code = f"print('plant_node: error: the flight diverged'); {words}; raise SystemExit(1)"
    process = NodeProcess("composed", [sys.executable, "-c", code], os.environ)
    try:
        ended(lambda: process.exit_code)
        first, *rest = [line.strip() for line in str(process.early_end()).splitlines()[1:]]
    finally:
        process.stop()
        process.close()
    assert first == "plant_node: error: the flight diverged"
    assert rest == [f"word {k}" for k in range(TAIL_LINES, 2 * TAIL_LINES)]


# Services are called once, when the answer will arrive

AGAIN_S = 0.1
UNHEARD = 2
"""So many answers are dropped, as to a client that has not been discovered."""


def test_an_answer_that_is_lost_to_a_new_caller_delays_the_call_and_no_more(
    domain: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(node_services, "ASK_AGAIN_S", AGAIN_S)
    server, caller = TemporaryNode("plant_node", domain), TemporaryNode("caller", domain)
    name, is_over = server.node.get_name(), threading.Event()
    answers, triggers = count(1), []

    def go(request: Any, response: Any) -> Any:
        triggers.append(request)
        is_over.wait(4 * AGAIN_S)  # as a step of many ticks
        response.success, response.message = True, "goes on"
        return response

    for kind, called, callback in ((GetState, "get_state", lambda _, r: r), (Trigger, "go", go)):
        service = server.node.create_service(kind, f"{name}/{called}", callback)

        def send_or_drop(*answer: Any, send: Any = service.send_response) -> None:
            if next(answers) > UNHEARD:
                send(*answer)

        service.send_response = send_or_drop
    executor = SingleThreadedExecutor(context=server.node.context)
    executor.add_node(server.node)

    def spin() -> None:
        while not is_over.is_set():
            executor.spin_once(timeout_sec=0.02)

    thread = threading.Thread(target=spin)
    thread.start()
    try:
        said = node_services.call_trigger(caller.node, f"{name}/go", lambda: None)
    finally:
        caller.leave()
        is_over.set()
        thread.join()
        executor.shutdown()
        server.leave()
    assert said == (True, "goes on")
    assert len(triggers) == 1, "what is not asked twice, as a step, is not done twice"
    assert next(answers) > UNHEARD + 2


# How flights end, and what is told of it

RECORDER, MISSION, CONTROLLER, PLANT = NODE_NAMES


@pytest.mark.parametrize(
    ("ends", "is_stopped", "failures"),
    [
        ([(PLANT, 0), (MISSION, 0), (CONTROLLER, 0), (RECORDER, 0)], False, []),
        ([(PLANT, 0), (RECORDER, 1)], False, ["recorder_node ended with exit code 1"]),
        ([(MISSION, -9), (PLANT, 0)], False, ["mission_node ended with exit code -9"]),
        ([(CONTROLLER, 0), (PLANT, 0)], False, ["controller_node ended before the flight did"]),
        ([(PLANT, 2)], False, ["plant_node ended with exit code 2"]),
        ([(name, 0) for name in reversed(NODE_NAMES)], True, ["stopped before the flight's end"]),
    ],
)
def test_a_launched_flight_is_complete_when_the_plant_ends_first_and_all_end_well(
    ends: list[tuple[str, int]], is_stopped: bool, failures: list[str]
) -> None:
    graph = LaunchedGraph()
    reasons = [graph.note_end(name, code, is_stopped=is_stopped) for name, code in ends]
    assert [reason for reason in reasons if reason] == failures
    assert graph.has_ended == (len(ends) == len(NODE_NAMES))
    complete = LaunchedGraph()  # before it is stopped
    assert complete.note_end(PLANT, 0, is_stopped=False) == ""
    assert [complete.note_end(n, 0, is_stopped=True) for n in NODE_NAMES[:3]] == [""] * 3
    assert complete.has_ended


HELD = {"controller_node": {"tick": "5", "references_held": "300"}}
HELD_WORDS = ["controller_node held the reference for 300 ticks, for the mission's did not come"]


@pytest.mark.parametrize(
    ("nodes", "kinds", "realtime", "degraded"),
    [
        ({"plant_node": {"refused: stamp": "1"}}, (), False, ([], [])),
        (HELD, ("kill_controller",), False, (HELD_WORDS, [])),
        (HELD, (), True, ([], HELD_WORDS)),
        (HELD, ("kill_mission",), False, ([], [])),
        (HELD, ("stop_mission",), False, ([], [])),
        (
            {"controller_node": {"rejected: reference: names": "2", "rejected: stamp": "9"}},
            (),
            False,
            ([], ["controller_node rejected: reference: names: 2 messages"]),
        ),
    ],
)
def test_a_held_reference_is_never_a_silent_success(
    nodes: dict[str, dict[str, str]], kinds: tuple[str, ...], realtime: bool, degraded: Any
) -> None:
    assert degradation(nodes, frozenset(kinds), realtime=realtime) == degraded
