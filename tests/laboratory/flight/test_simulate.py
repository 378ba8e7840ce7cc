"""Whole missions in this process: the numbers the flight software must reach."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest
from flights import space_robot, space_robot_here
from paths import DOCS

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.laws import laws
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import DivergedError, InputError


def _rms(**options: object) -> dict[str, float]:
    report = analyze(simulate(Flight(resolve(FlightPlan.model_validate(options)))))
    assert report["ticks"] == 60_000
    rms: dict[str, float] = report["rms"]["mean_axis"]
    return rms


def test_tde_stc_case_1() -> None:
    rms = _rms()
    assert max(rms["attitude"], rms["joints_1_3"], rms["joints_4_6"]) < 1e-7
    assert rms["base_torque"] == pytest.approx(0.7996, rel=0.005)
    assert rms["torque_1_3"] == pytest.approx(0.9304, rel=0.005)
    assert rms["torque_4_6"] == pytest.approx(0.0526, rel=0.005)


def test_tde_stc_case_1_without_friction() -> None:
    assert _rms(friction=False)["torque_4_6"] == pytest.approx(0.0450, rel=0.005)


@pytest.mark.parametrize("ticks", [1, 2, 4])
def test_tde_stc_with_late_commands(ticks: int) -> None:
    rms = _rms(command_latency_ticks=ticks)
    assert max(rms["attitude"], rms["joints_1_3"], rms["joints_4_6"]) < 1e-6


@pytest.mark.parametrize("law", sorted(laws()))
def test_every_law_flies_case_1_with_tuned_gains(law: str) -> None:
    rms = _rms(controller=law, gains="tuned")
    assert rms["attitude"] < 1e-6
    assert max(rms["joints_1_3"], rms["joints_4_6"]) < 1e-4
    assert rms["base_torque"] == pytest.approx(0.7996, rel=0.005)


def test_ctc_with_printed_gains_diverges_within_ticks() -> None:
    with pytest.raises(DivergedError) as caught:
        simulate(Flight(resolve(FlightPlan(controller="ctc", gains="printed"))))
    assert caught.value.tick < 20


def test_two_flights_are_the_same_to_the_last_bit() -> None:
    first, second = (
        simulate(Flight(resolve(FlightPlan(case="4-2", duration=0.5)))) for _ in range(2)
    )
    np.testing.assert_array_equal(first.joint_positions, second.joint_positions)
    np.testing.assert_array_equal(first.applied_torque, second.applied_torque)


def test_swaps_are_flown_at_their_ticks() -> None:
    """Up to the tick before it is the flight without a swap; a swap to the same law is none."""
    plain, swapped, same = (
        simulate(Flight(resolve(FlightPlan(duration=0.3, swaps=swaps))))
        for swaps in ([], ["0.2:ctc", "0.1:tde_smc"], ["0.1:tde_stc"])
    )
    assert plain.commanded_torque is not None
    assert swapped.commanded_torque is not None
    np.testing.assert_array_equal(same.commanded_torque, plain.commanded_torque)
    differs = (swapped.commanded_torque != plain.commanded_torque).any(axis=1)
    assert int(np.argmax(differs)) == 200
    assert swapped.telemetry is not None
    has_estimate = swapped.telemetry[:, 2].any(axis=1)
    np.testing.assert_array_equal(has_estimate[2:], np.arange(2, 600) < 400)  # ctc has none


def test_a_swap_after_the_end_changes_nothing() -> None:
    plain, swapped = (
        simulate(Flight(resolve(FlightPlan(duration=0.1, swaps=swaps))))
        for swaps in ([], ["0.1:ctc"])
    )
    np.testing.assert_array_equal(swapped.applied_torque, plain.applied_torque)


def test_faults_of_processes_need_the_graph() -> None:
    with pytest.raises(InputError, match="use `fly`"):
        simulate(Flight(resolve(FlightPlan(faults=["kill_recorder@1"]))))


def test_simulate_prints_what_its_bag_says(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    result = space_robot_here("simulate", "--duration", "0.2", "--bag", str(bag), "--json")
    assert result.returncode == 0, result.stderr
    ended = {"outcome": "complete", "reason": "", "ended_at_s": 0.2}
    assert json.loads(result.stdout) == analyze(read_flight(bag)) | ended


def test_a_law_of_ones_own_is_one_class_and_one_yaml(tmp_path: Path) -> None:
    """The example of docs/manual/control_laws.md."""
    text = (DOCS / "manual/control_laws.md").read_text()
    code, gains = (text.split(f"```{kind}\n")[1].split("```")[0] for kind in ("python", "yaml"))
    (tmp_path / "my_laws.py").write_text(code)
    (tmp_path / "gains").mkdir()
    (tmp_path / "gains" / "tde.yaml").write_text(gains)
    result = space_robot(
        "simulate",
        "--controller",
        "my_laws:TimeDelayControl",
        "--gains",
        f"{tmp_path}/gains",
        "--duration",
        "1",
        "--json",
        python_path=tmp_path,
    )
    assert result.returncode == 0, result.stderr
    report = json.loads(result.stdout)
    assert report["controller"] == "tde"
    assert report["rms"]["mean_axis"]["joints_1_3"] < 1e-5
