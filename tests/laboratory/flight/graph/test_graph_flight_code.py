"""On the graph: the controller's node answers in C, or compares."""

from __future__ import annotations

import re
import shutil
import socket
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from bags import COLUMNS
from exported_kernels import needs_compiler
from flights import Flown, space_robot_here

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.reader import read_flight

pytest.importorskip("rclpy")
OPTIONS = ("--duration", "0.25", "--case", "3", "--swap", "0.1:ctc")


@needs_compiler
@pytest.mark.parametrize("code", [("--controller-code", "c"), ("--shadow", "c")])
def test_the_flight_code_flies_the_same_bits_on_the_graph(
    code: tuple[str, str], fly: Callable[..., Flown]
) -> None:
    flown = read_flight(fly(*OPTIONS, *code).bag)
    plan = FlightPlan(duration=0.25, case="3", swaps=["0.1:ctc"])
    same = simulate(Flight(resolve(plan)))
    for name in COLUMNS:
        np.testing.assert_array_equal(getattr(flown, name), getattr(same, name), name)
    assert [law.name for law in flown.laws] == ["tde_stc", "ctc"]


def test_a_difference_ends_the_flight(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """That of a compiler that fuses products and sums, which flags and a pragma forbid."""
    cpu = Path("/proc/cpuinfo")
    if not shutil.which("gcc") or not cpu.exists() or " fma" not in cpu.read_text():
        pytest.skip("no gcc, or no processor with fused multiply-add")
    compiler = tmp_path / "fusing"
    compiler.write_text(
        "#!/bin/sh\nfor word; do case $word in */src/*.c) "
        'sed -i "/#pragma GCC/d" "${word%/*}/kernels.h";; esac; done\n'
        'exec gcc "$@" -mfma -ffp-contract=fast\n'
    )
    compiler.chmod(0o755)
    monkeypatch.setenv("CC", str(compiler))
    bag = tmp_path / "bag"
    ran = space_robot_here("fly", "--shadow", "c", "--duration", "0.2", "--bag", str(bag))
    assert ran.returncode == 1
    assert re.search(r"at tick \d+ the command of \w+ is \S+ in Python and \S+ in C", ran.stderr)
    assert read_flight(bag, trust=True).ticks < 400


def test_without_a_flight_computer_nothing_flies(tmp_path: Path) -> None:
    with socket.socket(socket.AF_INET, socket.SOCK_DGRAM) as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]
    code = f"udp:127.0.0.1:{port}"
    ran = space_robot_here("fly", "--controller-code", code, "--bag", str(tmp_path / "bag"))
    assert ran.returncode == 2
    assert "start the flight computer first" in ran.stderr
