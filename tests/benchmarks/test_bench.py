"""The benchmarks: that they work and compute right; no time is asserted anywhere."""

from __future__ import annotations

import importlib.util
import json
import statistics
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from paths import TESTS
from rich.console import Console

from benchmarks.command import BESIDE_PEERS, SECTIONS, bench
from benchmarks.display import print_section
from benchmarks.measure import Options, interleave, repeated
from benchmarks.result import Result, Target
from benchmarks.sections import section
from benchmarks.sections.laws import Recorded
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate

COMMAND = [sys.executable, str(TESTS / "benchmarks")]


class Clock:
    """Time that passes only in the competitors."""

    def __init__(self) -> None:
        self.now = 0.0
        self.runs: list[tuple[str, int]] = []

    def __call__(self) -> float:
        return self.now

    def competitor(self, name: str, seconds: float) -> Callable[[int], None]:
        def run(loops: int) -> None:
            self.runs.append((name, loops))
            self.now += loops * seconds

        return run


def test_interleave_takes_turns() -> None:
    clock = Clock()
    competitors = {"a": clock.competitor("a", 0.02), "b": clock.competitor("b", 0.001)}
    samples = interleave(competitors, 3, batch_s=0.05, clock=clock)
    assert {name: len(times) for name, times in samples.items()} == {"a": 3, "b": 3}
    assert samples["a"] == pytest.approx([0.02] * 3)
    assert samples["b"] == pytest.approx([0.001] * 3)
    turns = clock.runs[-6:]
    assert [name for name, _ in turns] == ["a", "b"] * 3
    assert len({loops for name, loops in turns if name == "a"}) == 1
    for (_, loops), seconds in zip(turns, (0.02, 0.001) * 3, strict=True):
        assert loops * seconds >= 0.05


def test_interleave_runs_what_is_long_once_a_batch() -> None:
    clock = Clock()
    interleave({"a": clock.competitor("a", 1.0)}, 2, clock=clock)
    assert clock.runs[-2:] == [("a", 1)] * 2
    clock.runs.clear()
    interleave({"a": clock.competitor("a", 1e-3)}, 2, warm_up=False, clock=clock)
    assert clock.runs == [("a", 1)] * 2


def test_repeated_calls_as_often_as_asked() -> None:
    calls: list[int] = []
    repeated(lambda: calls.append(1))(7)
    assert len(calls) == 7


def test_options() -> None:
    assert Options().batches(9) == 9
    assert Options(repetitions=3).batches(9) == 3
    assert Options(short=True, repetitions=3).batches() == 3
    assert Options(short=True).batch_s < Options().batch_s


def test_ratio_is_how_many_times_better() -> None:
    times = Result.timed("t", "us", [2e-6, 4e-6], ("peer", [8e-6, 8e-6]), Target(2.5, 3.5, "ratio"))
    assert times.samples == pytest.approx((2.0, 4.0))
    assert times.ratios == pytest.approx((4.0, 2.0))
    assert (times.relation, times.reached, times.reached_aim) == (">=", True, False)
    constant = Result.timed("t", "s", [0.5, 0.6], ("real time", [30.0]), Target(0.54))
    assert constant.ratios == pytest.approx((60.0, 50.0))
    assert (constant.relation, constant.reached, constant.reached_aim) == ("<=", False, None)
    rate = Result("r", "ticks/s", (80.0, 90.0), constant.beside, Target(100.0), better="more")
    assert rate.ratios == pytest.approx((80.0 / 30.0, 3.0))
    assert (rate.relation, rate.reached) == (">=", False)
    assert Result("r", "s", (1.0,)).reached is None
    with pytest.raises(ValueError, match="beside nothing"):
        _ = Result("r", "s", (1.0,), target=Target(2.0, of="ratio")).reached


def test_table_shows_everything(capsys: pytest.CaptureFixture[str]) -> None:
    result = Result.timed(
        "one step", "us", [2e-6, 2e-6], ("peer", [8e-6, 8e-6]), Target(5.0, of="ratio"), "a remark"
    )
    print_section("plant", [result], Console(width=80))
    text = capsys.readouterr().out
    for words in ("one step", "2 us", "peer: 8", "4.00", ">= 5", "missed", "a remark"):
        assert words in text


@pytest.fixture(scope="module")
def report(tmp_path_factory: pytest.TempPathFactory) -> dict[str, Any]:
    path = tmp_path_factory.mktemp("bench") / "bench.json"
    arguments = ["--short", "plant", "laws", "simulate", "--json", "--output", str(path)]
    result = CliRunner().invoke(bench, arguments, catch_exceptions=False)
    assert result.exit_code == 0, result.output
    found: dict[str, Any] = json.loads(result.stdout)
    assert json.loads(path.read_text("utf-8")) == found
    assert "measuring" in result.stderr
    return found


def test_report_holds_what_it_promises(report: dict[str, Any]) -> None:
    assert report["short"] is True
    assert list(report["sections"]) == ["plant", "laws", "simulate"]
    machine = report["machine"]
    assert machine["cpus_allowed"] >= 1
    assert set(machine["python_build"]) == {"pgo", "lto", "debug"}
    assert {"numpy", "numba"} <= set(machine["packages"])
    for rows in report["sections"].values():
        for row in rows:
            own = row["samples"]["this"]
            assert len(own) == 2
            assert all(value > 0.0 for value in own)
            assert row["median"] == pytest.approx(statistics.median(own))
            assert row["spread"] == [min(own), max(own)]


def test_ratios_are_those_of_the_samples(report: dict[str, Any]) -> None:
    for row in (row for rows in report["sections"].values() for row in rows):
        if row["beside"] is None:
            assert row["ratio"] is None
            continue
        other = np.broadcast_to(row["samples"][row["beside"]], len(row["samples"]["this"]))
        ratios = other / np.array(row["samples"]["this"])
        assert row["ratio"] == pytest.approx(np.median(ratios))
        assert row["ratio_spread"] == pytest.approx([ratios.min(), ratios.max()])


def test_all_laws_stand_beside_computed_torque(report: dict[str, Any]) -> None:
    rows = {row["name"]: row for row in report["sections"]["laws"]}
    for part in ("tick", "equation"):
        assert rows[f"ctc, {part}"]["beside"] is None
        for law in ("ctc_smc", "tde_smc", "tde_tsmc", "tde_stc"):
            assert rows[f"{law}, {part}"]["beside"] == f"ctc, {part}"
    asked = rows["tde_stc, tick"]["asked"]
    assert (asked["relation"], asked["limit"]) == ("<=", 1.0)


def test_recorded_flight_is_flown_again_to_the_bit() -> None:
    """What is timed as a controller's tick is what the flight computed."""
    for law in ("tde_stc", "ctc"):
        flight = Flight(resolve(FlightPlan(controller=law, case="3")))
        flight.ticks = 20
        log = simulate(flight)
        assert log.commanded_torque is not None
        for ticks in (1, 7, 20):
            run, torque = Recorded.of(law, 20).whole_tick()
            run(ticks)
            np.testing.assert_array_equal(torque, log.commanded_torque[ticks - 1])


def test_unknown_section_is_named_with_the_allowed_ones() -> None:
    result = CliRunner().invoke(bench, ["plants"])
    assert result.exit_code == 2
    assert "'plants'" in result.stderr
    for name in SECTIONS:
        assert name in result.stderr


def test_help_names_every_section() -> None:
    text = CliRunner().invoke(bench, ["--help"]).stdout
    for name in SECTIONS:
        assert name in text


def test_output_that_cannot_be_written_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "missing" / "bench.json"
    result = subprocess.run(
        [*COMMAND, "--output", str(path)], capture_output=True, text=True, check=False
    )
    assert result.returncode == 2
    assert str(path) in result.stderr
    assert len(result.stderr.splitlines()) == 1


@pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in ("mujoco", "pinocchio")),
    reason="needs mujoco and pin",
)
def test_peers_fly_the_same_robot(tmp_path: Path) -> None:
    picture = tmp_path / "growth.png"
    result = subprocess.run(
        [*COMMAND, "peers", "growth", "--short", "--json", "--plot", str(picture)],
        capture_output=True,
        text=True,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    found = json.loads(result.stdout)["sections"]
    beside = {row["beside"] for row in found["peers"]}
    assert beside >= {"mujoco", "pinocchio, 4 aba from Python"}
    for name, joints in (("peers", (6,)), ("growth", (6, 7))):
        checks = [row for row in found[name] if row["is_condition"]]
        for n in joints:
            moved, *apart = (row for row in checks if row["name"].startswith(f"{n} joints"))
            assert moved["name"].endswith("motion")
            assert moved["median"] > 1e-3
            assert {"mujoco apart", "pinocchio apart"} <= {
                row["name"].split(": ")[1] for row in apart
            }
            assert all(row["reached"] for row in apart)
    names = [row["name"] for row in found["growth"]]
    for peer in ("mujoco, step", "pinocchio, aba in C++", "pinocchio, aba from Python"):
        assert [row["beside"] for row in found["growth"]].count(peer) == 2
        assert f"exponent, all sizes: {peer}" in names
    assert not [name for name in names if name.startswith("exponent, from 10 joints on")]
    assert picture.read_bytes().startswith(b"\x89PNG")


def test_a_step_with_wheels_stands_beside_one_without() -> None:
    result = CliRunner().invoke(bench, ["wheels", "--short", "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    step, *checks = json.loads(result.stdout)["sections"]["wheels"]
    assert step["beside"] == "ideal"
    assert step["median"] > 0.0
    assert [row["reached"] for row in checks] == [True] * len(checks)


@pytest.mark.skipif(
    any(importlib.util.find_spec(name) is None for name in ("Basilisk", "mujoco", "pinocchio")),
    reason="needs bsk, mujoco and pin",
)
def test_torques_in_orbit_stand_beside_basilisks() -> None:
    result = CliRunner().invoke(bench, ["orbit", "--short", "--json"], catch_exceptions=False)
    assert result.exit_code == 0, result.output
    rows = {row["name"]: row for row in json.loads(result.stdout)["sections"]["orbit"]}
    for source in ("gravity gradient", "drag", "sunlight"):
        assert rows[f"{source}: torque apart"]["reached"]
        assert rows[f"{source}: attitude apart, 2 min"]["reached"]
    assert rows["drag: torque apart where the air stands still"]["median"] > 0.05


def test_the_orbit_is_left_out_without_basilisk(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.peers.is_installed", lambda module: module != "Basilisk")
    result = CliRunner().invoke(bench, ["orbit", "--short", "--json"])
    assert result.exit_code == 0
    assert json.loads(result.stdout)["sections"] == {}
    assert "orbit is left out: no Basilisk here" in result.stderr


def test_a_peer_that_is_another_robot_ends_the_command_with_exit_code_1(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    row = Result("apart", "", (1e-6,), target=Target(1e-9), is_condition=True)
    monkeypatch.setattr("benchmarks.sections.plant.plant", lambda options: [row])
    result = CliRunner().invoke(bench, ["plant", "--short"])
    assert result.exit_code == 1
    assert "missed" in result.stdout


def test_every_section_is_a_function_of_its_file() -> None:
    folder = TESTS / "benchmarks/sections"
    files = {path.stem for path in folder.glob("*.py")} - {"__init__"}
    assert files == {name.replace("-", "_") for name in SECTIONS}
    for name in set(SECTIONS) - BESIDE_PEERS:
        assert callable(section(name))


def test_missing_peers_are_left_out_with_a_word(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("benchmarks.peers.is_installed", lambda module: False)
    result = CliRunner().invoke(bench, ["peers", "growth", "--short", "--json"])
    assert result.exit_code == 0
    assert json.loads(result.stdout)["sections"] == {}
    assert "peers is left out: no MuJoCo and no Pinocchio here" in result.stderr
