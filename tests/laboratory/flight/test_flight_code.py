"""The flight code in C in the controller's place, beside it, and on a flight computer."""

from __future__ import annotations

import re
import shutil
import socket
import subprocess
import threading
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from exported_kernels import needs_compiler
from flights import Flown, planned, simulated, space_robot_here
from matrix.scenarios import difference
from paths import ROOT

from space_robot.export.software import export
from space_robot_control.flight_code.instances import (
    BEGIN,
    FlightComputer,
    FlightLibrary,
    write_sources,
)
from space_robot_control.flight_code.supervisors import ShadowError, bits
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import FlightError, InputError

HARD: dict[str, Any] = {
    "case": "3",
    "sensors": "fine",
    "navigation": "filtered",
    "swaps": ["0.05:ctc"],
    "faults": ["nan_state@0.07-0.08:0.5", "drop_state@0.08-0.09:0.5"],
    "duration": 0.1,
}


def flown(**options: Any) -> FlightLog:
    return simulated(**{"duration": 0.06, **options})


@needs_compiler
def test_a_difference_ends_the_flight_and_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    answer, answered = FlightLibrary.answer, []

    def wrong(self: FlightLibrary, state: Any, reference: Any) -> int:
        status = answer(self, state, reference)
        answered.append(state.tick)
        if state.tick >= 77:
            self.command[4] = np.nextafter(self.command[4], np.inf)
        return status

    monkeypatch.setattr(FlightLibrary, "answer", wrong)
    with pytest.raises(ShadowError) as error:
        flown(shadow="c")
    assert "at tick 77 the command of joint2 is " in str(error.value)
    assert " in Python and " in str(error.value)
    assert error.value.exit_code == 1
    assert answered[-1] == 77
    assert error.value.log is not None
    assert error.value.log.ticks in (77, 78)


@needs_compiler
def test_a_judgement_that_differs_is_named(monkeypatch: pytest.MonkeyPatch) -> None:
    judge = FlightLibrary.judge_stamp
    monkeypatch.setattr(
        FlightLibrary, "judge_stamp", lambda self, tick: judge(self, tick) + (tick == 9)
    )
    with pytest.raises(ShadowError, match="at tick 9 Python judges the stamp as 1, C as 2"):
        flown(shadow="c")


def test_all_nan_are_one() -> None:
    other = np.array([0xFFF8000000000001], np.uint64).view(np.float64)
    assert bits(np.array([np.nan]))[0] == bits(other)[0]
    assert bits(np.array([0.0]))[0] != bits(np.array([-0.0]))[0]


def nothing(signals: Any) -> Any:
    return 0.0 * signals.error


def test_a_law_in_python_cannot_answer_in_c() -> None:
    with pytest.raises(InputError, match="the law 'nothing' is a Python function and cannot"):
        flown(controller=nothing, controller_code="c")


@needs_compiler
def test_the_node_answers_in_c_and_compares(fly: Callable[..., Flown]) -> None:
    """The graph's flight, from one law to another, is the one in this process."""
    options = ("--duration", "0.1", "--swap", "0.05:ctc", "--shadow", "c", "--composed")
    expected = flown(duration=0.1, swaps=["0.05:ctc"])
    assert difference(read_flight(fly(*options).bag), expected, {"telemetry"}) == ""


@pytest.fixture(scope="module")
def flight_computer(tmp_path_factory: pytest.TempPathFactory) -> Iterator[int]:
    """The example's program for `HARD`, running; its port."""
    if not shutil.which("cc"):
        pytest.skip("no C compiler is installed")
    exported = export(planned(**HARD), ["tde_smc"])
    tmp_path = tmp_path_factory.mktemp("computer")
    sources = write_sources(tmp_path, exported.sources)
    program = tmp_path / "flight_computer"
    flags = ["-std=c99", "-O1", "-ffp-contract=off", "-Wall", "-Wextra", "-Wpedantic", "-Werror"]
    own = str(ROOT / "examples" / "flight_computer" / "flight_computer.c")
    includes = [f"-I{tmp_path / 'include'}", f"-I{tmp_path}"]
    subprocess.run(["cc", *flags, *includes, "-o", str(program), own, *sources, "-lm"], check=True)
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    running = subprocess.Popen([str(program), str(port)], stdout=subprocess.PIPE, text=True)
    assert running.stdout is not None
    assert running.stdout.readline() == f"flight software of 9 axes listens on 127.0.0.1:{port}\n"
    yield port
    running.terminate()
    answered, _ = running.communicate(timeout=10)
    assert running.returncode == 0
    assert "states answered" in answered


def test_a_flight_computer_answers_with_the_same_bits(flight_computer: int) -> None:
    """Twice: it begins anew with every flight. The laws of the swaps are the node's choice. One of
    another robot is refused."""
    code, python = f"udp:127.0.0.1:{flight_computer}", flown(**HARD)
    for _ in range(2):
        assert difference(flown(**HARD, controller_code=code), python) == ""
    with pytest.raises(InputError, match="exported for another robot or other actuators"):
        flown(controller_code=code, robot="seven_joint", mission="seven_joint")


@pytest.mark.parametrize("command", ["simulate", "fly"])
def test_without_a_flight_computer_nothing_flies(command: str, tmp_path: Path) -> None:
    code = ("--controller-code", "udp:127.0.0.1:9", "--bag", str(tmp_path / "bag"))
    ran = space_robot_here(command, *code)
    assert ran.returncode == 2
    assert re.search(r"udp:127\.0\.0\.1:9: .*start the flight computer first", ran.stderr)


def test_one_that_falls_silent_ends_the_flight(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("space_robot_control.flight_code.instances.TIMEOUT_S", 0.2)
    exported = export(planned())
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as server:
        server.bind(("127.0.0.1", 0))

        def greet() -> None:
            data, peer = server.recvfrom(65_507)
            assert int(np.frombuffer(data[:8], np.int64)[0]) == BEGIN
            server.sendto(bytes(computer_bytes), peer)

        computer_bytes = 8 * (3 + 1 + 9 + 12 + 36)
        thread = threading.Thread(target=greet)
        thread.start()
        computer = FlightComputer(exported, "127.0.0.1", server.getsockname()[1])
        thread.join()
        with pytest.raises(FlightError, match="the flight computer does not answer"):
            computer.judge_stamp(0)
