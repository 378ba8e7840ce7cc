"""Each scenario has the bits it had before, in every way in which it can be flown."""

from __future__ import annotations

import json
import os
import pickle
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from command import run_program
from cpu_device import CpuDevice
from exported_kernels import needs_compiler
from flights import space_robot_here

from matrix.scenarios import (
    ADVICE,
    CELLS,
    HERE,
    OF_A_FEW,
    OF_THE_PROCESS,
    PLANS,
    Planned,
    columns_of,
    difference,
    digests,
    fly,
    in_root,
    stored_digests,
    what_changed,
)
from space_robot import FlownFlight
from space_robot.analysis.words import with_statistic
from space_robot.flight.batch import FlightBatch, batches
from space_robot.flight.plan import Flight
from space_robot.gpu.fly import fly_on_device
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.compiled.lanes import WIDTH

NAMES = {"bag", "mission", "sensors", "actuators", "orbit", "case", "gains", "own_gains"}
MASKED = ("swaps_on_wheels", "tools_in_every_frame", "two_arms", "gears_in_orbit")
C_LIBRARY = "glibc.cpu.hwcaps=-AVX2,-FMA,-FMA4,-AVX512F,-AVX512VL,-AVX2_Usable,-FMA_Usable"
"""This processor without what its sines are chosen by, in the words of old and new versions."""
MASK = {
    "GLIBC_TUNABLES": C_LIBRARY,
    "NPY_DISABLE_CPU_FEATURES": "X86_V3 X86_V4 AVX512_ICL AVX2 FMA3 AVX512F AVX512_SKX",
    "OPENBLAS_CORETYPE": "Prescott",
}
"""What the C library, NumPy and its matrix products are to believe of the processor."""
Get = Callable[[Planned], FlownFlight]


def cells(name: str) -> pytest.MarkDecorator:
    """Parametrize a test with the scenarios that have a cell."""
    assert name in (*CELLS, *OF_A_FEW)
    return pytest.mark.parametrize("plan", [p for p in PLANS.values() if p.has(name)], ids=str)


@pytest.fixture(scope="session")
def flown(tmp_path_factory: pytest.TempPathFactory) -> Get:
    """Fly a scenario in this process, once."""
    folder, flights = tmp_path_factory.mktemp("matrix"), {}

    def get(plan: Planned) -> FlownFlight:
        if plan.name not in flights:
            flights[plan.name] = fly(plan, folder / plan.name)
        return flights[plan.name]

    return get


@pytest.fixture(autouse=True)
def _paths_begin_in_root() -> Any:
    with in_root():
        yield


def scenario_file(folder: Path, options: dict[str, Any]) -> str:
    """Write options as a user does."""
    file = folder / "scenario.yaml"
    file.write_text(yaml.safe_dump(options), "utf-8")
    return str(file)


def unnamed(report: Any) -> Any:
    """Return a report without the names of the files that settings came from."""
    if not isinstance(report, dict):
        return report
    return {key: unnamed(value) for key, value in report.items() if key not in NAMES}


def assert_bag_is(bag: Path, expected: FlownFlight) -> None:
    """Compare what a bag tells with a flight in this process."""
    log = read_flight(bag, trust=True)
    assert log.damage == ()
    assert difference(log, expected.log, OF_THE_PROCESS) == ""
    assert (log.laws, log.unanswered) == (expected.log.laws, expected.log.unanswered)


@pytest.mark.parametrize("plan", PLANS.values(), ids=str)
def test_the_bits_are_those_of_before(plan: Planned, flown: Get) -> None:
    now, stored = digests(flown(plan)), stored_digests().get(plan.name)
    assert stored, f"{plan.name} has no digests yet: python tests/matrix --write"
    if now != stored:
        pytest.fail(f"other bits: {what_changed(now, stored)}\n{ADVICE}", pytrace=False)


def test_they_are_those_of_a_processor_that_lacks_most() -> None:
    """In a process that is told so: sines, sums and products come from other code there."""
    command = [sys.executable, str(HERE), *MASKED]
    ran = run_program(command, env={**os.environ, **MASK})
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert ran.stdout.splitlines() == [f"{name}: as stored" for name in MASKED]


def test_every_signal_moves(flown: Get) -> None:
    """Each column has numbers that change, in some flight."""
    spans: dict[str, float] = {}
    for plan in PLANS.values():
        for name, column in columns_of(flown(plan).log).items():
            rows = column[np.isfinite(column).all(axis=tuple(range(1, column.ndim)))]
            span = float(np.ptp(rows, axis=0).max(initial=0.0)) if len(rows) else 0.0
            spans[name] = max(span, spans.get(name, 0.0))
    assert [name for name, span in spans.items() if span == 0.0] == []


@cells("bag")
def test_its_bag_tells_it(plan: Planned, flown: Get) -> None:
    flight = flown(plan)
    assert flight.bag
    assert_bag_is(flight.bag, flight)


@cells("printed")
def test_the_printed_scenario_flies_it_again(plan: Planned, flown: Get, tmp_path: Path) -> None:
    """As the commands do it: with the same table, and a bag of the same flight."""
    printed = space_robot_here("scenario", "--scenario", scenario_file(tmp_path, plan.options))
    assert printed.returncode == 0, printed.stderr
    (tmp_path / "printed.yaml").write_text(printed.stdout, "utf-8")
    words = ["--scenario", str(tmp_path / "printed.yaml"), "--bag", str(tmp_path / "bag"), "--json"]
    expected = flown(plan)
    ran = space_robot_here("simulate", *words)
    assert ran.returncode == (0 if expected.is_complete else 1), ran.stderr
    assert_bag_is(tmp_path / "bag", expected)
    assert unnamed(json.loads(ran.stdout)) == unnamed(
        json.loads(json.dumps(expected.report()), parse_constant=lambda _: None)
    )


@cells("bench")
def test_a_bench_flies_it_step_by_step(plan: Planned, flown: Get) -> None:
    """Also if it goes back to a snapshot in between, and continues as a copy."""
    expected, bench = flown(plan), plan.scenario.bench()
    half = expected.log.ticks // 2
    while not bench.done:
        if bench.tick == half:
            snapshot = bench.save()
            for _ in range(min(5, expected.log.ticks - half - 1)):
                bench.step()
            bench.restore(pickle.loads(pickle.dumps(snapshot)))
        bench.step()
    assert difference(bench.log(), expected.log) == ""
    assert (bench.outcome, bench.reason) == (expected.outcome, expected.reason)
    assert bench.log().laws == expected.log.laws


def memory(flight: Flight) -> list[bytes]:
    """What a flown flight leaves behind: of its law, if it flew to the end."""
    plant, law = flight.plant, flight.controller.law
    parts = ("x", "truth", "measured", "actuators", "sensors", "environment", "model")
    left = [getattr(plant.memory, part).tobytes() for part in parts]
    left.append(plant.command_delay_buffer.tobytes())
    law_left = [law.memory.s.tobytes(), law.memory.u.tobytes()]
    return left + (law_left if plant.tick == flight.ticks else [])


@cells("lanes")
def test_it_flies_among_seven_others(plan: Planned, flown: Get) -> None:
    """In a lane of a batch, beside flights with other seeds, cases and faults."""
    own = list(PLANS).index(plan.name) % WIDTH
    law, gains = flown(plan).flight.law, {}
    if "gains" not in plan.options:
        gains = {law.name: law.gain_values}
    flights = [
        (plan.scenario if k == own else plan.scenario.replace(**plan.neighbour(k, gains))).check()
        for k in range(WIDTH)
    ]
    assert [len(group) for group in batches(enumerate(flights))] == [WIDTH]
    blocks = [block for block in FlightBatch(flights).fly() if block.flight == own]
    expected = flown(plan)
    assert len(blocks) == 1
    assert difference(blocks[0].log, expected.log) == ""
    assert blocks[0].log.laws == expected.log.laws
    assert blocks[0].ending.reason == expected.reason
    for left, wanted in zip(memory(flights[own]), memory(expected.flight), strict=True):
        assert left == wanted


@cells("lanes")
def test_it_flies_on_a_device(plan: Planned, flown: Get) -> None:
    """Beside another flight, by the program for a GPU, compiled for this processor."""
    expected, device = flown(plan), CpuDevice()
    law = expected.flight.law
    gains = {} if "gains" in plan.options else {law.name: law.gain_values}
    flights = [plan.scenario.replace(**plan.neighbour(1, gains)).check(), plan.scenario.check()]
    _, block = fly_on_device(flights, device)
    assert difference(block.log, expected.log) == ""
    assert block.log.laws == expected.log.laws
    assert block.ending.reason == expected.reason
    for part in ("truth", "state"):
        left, wanted = (getattr(f.plant, part).block for f in (flights[1], expected.flight))
        assert left.tobytes() == wanted.tobytes()
    assert len(device.texts) == 1


@cells("messages")
def test_it_flies_message_by_message(plan: Planned, flown: Get, tmp_path: Path) -> None:
    """As if messages could fail: the loop of the nodes, without ROS."""
    faults = [*plan.options.get("faults", []), "drop_state@0:0"]
    expected, flight = flown(plan), plan.scenario.replace(faults=faults).fly(tmp_path / "bag")
    if expected.log.measured is None:  # they are recorded only where they differ
        flight.log.measured = flight.log.assumed_error = None
    assert difference(flight.log, expected.log, OF_THE_PROCESS) == ""
    assert (flight.log.laws, flight.log.filled) == (expected.log.laws, 0)
    assert flight.reason == expected.reason


@needs_compiler
@cells("c")
def test_c_answers_it_alike(plan: Planned, flown: Get, tmp_path: Path) -> None:
    """The exported flight software in the controller's place."""
    expected, flight = flown(plan), plan.scenario.replace(controller_code="c").fly(tmp_path / "bag")
    assert difference(flight.log, expected.log, OF_THE_PROCESS) == ""
    assert flight.log.laws == expected.log.laws
    assert flight.reason == expected.reason


def rms_of(report: dict[str, Any]) -> dict[str, float]:
    return with_statistic(report["metrics"], "rms_eq64")


def fly_graph(plan: Planned, folder: Path, expected: FlownFlight, *words: str) -> None:
    file = scenario_file(folder, plan.options)
    bag = folder / "bag"
    ran = space_robot_here("fly", *words, "--scenario", file, "--bag", str(bag), "--json")
    assert ran.returncode == (0 if expected.is_complete else 1), ran.stderr
    assert_bag_is(bag, expected)
    report, own = (
        json.loads(ran.stdout),
        json.loads(json.dumps(expected.report()), parse_constant=lambda _: None),
    )
    assert report["outcome"] == own["outcome"]
    assert rms_of(report) == rms_of(own)


@pytest.mark.ros
@cells("graph")
def test_nodes_in_one_process_fly_it(plan: Planned, flown: Get, tmp_path: Path) -> None:
    fly_graph(plan, tmp_path, flown(plan), "--composed")


@pytest.mark.ros
@cells("processes")
def test_four_processes_fly_it(plan: Planned, flown: Get, tmp_path: Path) -> None:
    fly_graph(plan, tmp_path, flown(plan))


@cells("replay")
def test_a_controller_gives_the_recorded_commands_again(plan: Planned, flown: Get) -> None:
    flight = flown(plan)
    ran = space_robot_here("replay", str(flight.bag), "--trust", "--json")
    assert ran.returncode == 0, ran.stdout + ran.stderr
    assert json.loads(ran.stdout)["identical"], ran.stdout
