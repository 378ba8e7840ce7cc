"""``space-robot gains``: what it prints and refuses."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner, Result

from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.tuning.equal_ripple import LINEAR_SHARE
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import laws
from space_robot_msgs_py.errors import InputError, SpaceRobotError


def run(*arguments: str, columns: int = 80) -> Result:
    return CliRunner(env={"COLUMNS": str(columns)}).invoke(cli, ["gains", *arguments])


def report(*arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(run("check", *arguments, "--json").stdout)
    return found


def test_table_iv_has_little_margin_which_is_a_remark() -> None:
    result = run("check", "--json")
    assert result.exit_code == 0
    assert result.stderr == (
        "remark: tde_smc, tde_stc, tde_tsmc: h_bar leaves a margin below 2% in torque scale\n"
    )
    found = json.loads(result.stdout)
    assert found["is_sound"] is False
    assert found["is_stable"] is True
    assert list(found["laws"]) == sorted(laws())
    stc = found["laws"]["tde_stc"]
    assert stc["torque_scale_margin"] == pytest.approx(0.0031, abs=5e-5)
    assert stc["spectral_radius"] == pytest.approx(0.997, abs=5e-4)
    assert stc["spectral_norm"] == pytest.approx(1.029, abs=5e-4)
    # h_bar sigma / delta, and J0 = E / 2 on either side of the base
    assert stc["noise_gain"][3:6] == pytest.approx([5.0 / 5e-4 + 5.0] * 3)
    assert stc["noise_gain"][:3] == pytest.approx([0.25 * (50.0 / 5e-4 + 50.0)] * 3)


def test_an_estimate_that_diverges_is_a_failure() -> None:
    result = run("check", "--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[1e4]")
    assert isinstance(result.exception, SpaceRobotError)
    assert result.exception.exit_code == 1
    assert str(result.exception).startswith("tde_stc: the estimate diverges")
    assert "remark" not in result.stderr


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
def test_the_gains_that_are_flown_by_default_pass(robot: str) -> None:
    assert run("check", "--robot", robot).exit_code == 0


def test_laws_with_a_model_are_sound() -> None:
    result = run("check", "--controller", "ctc")
    assert result.exit_code == 0
    assert "H_S^-1 h_bar" not in result.stdout
    keys = report("--controller", "ctc")["laws"]["ctc"].keys()
    assert keys == {"is_stable", "is_sound", "loop_radius", "noise_gain"}


def test_a_free_base_leaves_the_joints_to_be_judged() -> None:
    """Table IV: seven times the margin, so that it is sound; the base gets no torque of noise."""
    result = run("check", "--actuators", "none")
    assert result.exit_code == 0
    assert "H_f^-1 h_bar" in result.stdout
    found = report("--actuators", "none")
    assert found["actuators"] == "none"
    stc = found["laws"]["tde_stc"]
    assert stc["torque_scale_margin"] == pytest.approx(0.0237, abs=5e-5)
    for law in found["laws"].values():
        assert law["noise_gain"][:3] == [0.0] * 3
    assert stc["noise_gain"][3:6] == pytest.approx([5.0 / 5e-4 + 5.0] * 3)
    turned = ("--set", "mission.base_quaternion=[0.0, 1.0, 0.0, 0.0]")
    again = report("--actuators", "none", *turned)["laws"]["ctc"]
    assert again["noise_gain"] == found["laws"]["ctc"]["noise_gain"]


@pytest.mark.parametrize("robot", ["paper", "flexible_panels"])
def test_no_attitude_of_the_base_makes_a_difference(robot: str) -> None:
    """Also of one 180 degrees from the inertial frame, for every law's every number."""
    found = report("--robot", robot)
    for quaternion in ([0.0, 1.0, 0.0, 0.0], [0.1, 0.7, 0.5, -0.5]):
        again = report("--robot", robot, "--set", f"mission.base_quaternion={quaternion}")
        assert again["laws"] == found["laws"]


def test_parameters_count_as_in_a_flight() -> None:
    one = report("--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[0.5]")
    two = report("--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[1.0]")
    smallest = [found["laws"]["tde_stc"]["smallest_eigenvalue"] for found in (one, two)]
    assert smallest[1] == pytest.approx(2.0 * smallest[0])
    heavy = report("--controller", "tde_stc", "--case", "4-2")["laws"]["tde_stc"]
    assert heavy["torque_scale_margin"] == pytest.approx(0.0023, abs=5e-5)


def test_tables_fit_a_terminal() -> None:
    text = run("check", "--robot", "seven_joint").stdout
    for words in ("radius", "margin", "wrist_roll", "tde_tsmc", "small"):
        assert words in text
    assert "…" not in text


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--controller", "nothing"), "unknown controller 'nothing'"),
        (("--gains", "nothing"), "unknown gain set 'nothing'"),
        (("--robot", "nothing"), "unknown robot 'nothing'"),
        (("--set", "controller.tde_stc.h_bar=[-1.0]"), "values above 0"),
    ],
)
def test_bad_input_is_told(options: tuple[str, ...], said: str) -> None:
    error = run("check", *options).exception
    assert isinstance(error, InputError)
    assert said in str(error)


def test_a_flight_says_it_on_standard_error_alone() -> None:
    runner = CliRunner()
    options = ("--gains", "printed", "--duration", "0.01", "--json")
    result = runner.invoke(cli, ["simulate", *options])
    assert result.exit_code == 0
    json.loads(result.stdout)
    assert "warning: tde_stc: h_bar leaves 0.31% of margin" in result.stderr


def tune(folder: Path, *options: str) -> Result:
    return run("tune", *options, "-o", str(folder))


def test_a_set_for_a_mission_that_points_needs_its_orbit_and_knows_the_tick(tmp_path: Path) -> None:
    inspection = ("--robot", "ets_vii", "--mission", "ets_vii_inspection")
    refused = tune(tmp_path, *inspection)
    assert isinstance(refused.exception, InputError)
    assert "choose one by --orbit NAME" in str(refused.exception)
    sets = [tmp_path / name for name in ("fast", "slow")]
    for folder, tick in zip(sets, ("0.0005", "0.005"), strict=True):
        result = tune(folder, *inspection, "--orbit", "iss", "--period", tick)
        assert result.exit_code == 0, result.exception
        assert f"--orbit iss --period {tick}" in (folder / "ctc.yaml").read_text("utf-8")
    filters = [(folder / "controller.yaml").read_text("utf-8").splitlines()[1:] for folder in sets]
    assert filters[0] != filters[1]


def test_a_mission_of_segments_is_tuned_for(tmp_path: Path) -> None:
    assert tune(tmp_path, "--mission", "line").exit_code == 0
    assert (tmp_path / "ctc.yaml").is_file()
    here = "mission.waypoints_deg=[0.0, 90.0, 200.0, 20.0, 30.0, 10.0]"
    still = tune(tmp_path, "--set", "mission.waypoint_times=[0.0]", "--set", here)
    assert "moves neither joints nor base" in str(still.exception)


def test_a_tuned_set_flies_and_is_sound(tmp_path: Path) -> None:
    folder = tmp_path / "set"
    result = tune(folder, "--case", "1", "--case", "4-2")
    assert result.exit_code == 0, result.exception
    assert result.stdout == ""
    assert {file.stem for file in folder.iterdir()} == {*laws(), "controller"}
    assert run("check", "--gains", str(folder)).exit_code == 0
    flight = Flight(resolve(FlightPlan(gains=str(folder), duration=0.1)))
    assert flight.controller_settings.acceleration_filter_hz == pytest.approx(99.3, rel=0.01)
    assert list(flight.laws) == sorted(laws(), key=lambda name: (name != "tde_stc", name))
    simulate(flight)


def test_what_the_set_says_to_the_controller_is_in_the_bag_and_may_be_overruled(
    tmp_path: Path,
) -> None:
    tune(tmp_path)
    flight = Flight(resolve(FlightPlan(gains=str(tmp_path))))
    corner = flight.controller_settings.acceleration_filter_hz
    assert flight.description["parameters"]["controller"]["acceleration_filter_hz"] == corner > 0.0
    given = {"controller": {"acceleration_filter_hz": 7.0}}
    over = Flight(resolve(FlightPlan(gains=str(tmp_path), parameters=given)))
    assert over.controller_settings.acceleration_filter_hz == 7.0
    alone = ControllerNodeSettings.resolve({"gains": str(tmp_path)})  # as a node by itself has it
    assert alone.acceleration_filter_hz == corner


def test_the_same_command_writes_the_same_bytes(tmp_path: Path) -> None:
    texts = []
    for _ in range(2):
        tune(tmp_path / "set", "--robot", "seven_joint")
        texts.append({file.name: file.read_bytes() for file in (tmp_path / "set").iterdir()})
    assert texts[0] == texts[1]
    command = f"space-robot gains tune --robot seven_joint -o {tmp_path / 'set'}"
    assert texts[0]["ctc.yaml"].decode().splitlines()[0] == f"# Made by `{command}`."


@pytest.mark.parametrize(
    ("options", "said"),
    [
        (("--robot", "nothing"), "unknown robot 'nothing'"),
        (("--case", "nothing"), "unknown case 'nothing'"),
        (("--mission", "nothing"), "unknown mission 'nothing'"),
        (("--bandwidth", "1000"), "bandwidth must be at most"),
    ],
)
def test_what_cannot_be_tuned_is_told(options: tuple[str, ...], said: str, tmp_path: Path) -> None:
    error = tune(tmp_path / "set", *options).exception
    assert isinstance(error, InputError)
    assert said in str(error)
    assert not (tmp_path / "set").exists()


@pytest.mark.parametrize("option", ["--margin", "--mass-uncertainty", "--bandwidth"])
def test_numbers_out_of_range_are_refused(option: str, tmp_path: Path) -> None:
    assert tune(tmp_path, option, "-1").exit_code == 2


def test_a_set_for_sensors_keeps_the_ripple_it_is_allowed(tmp_path: Path) -> None:
    """Closed loop with noise of L1, on every axis, beside what was allowed without any loop."""
    parameter = "controller.hold_ticks=100"
    result = tune(tmp_path, "--sensors", "white_l1", "--ripple", "0.05", "--set", parameter)
    assert result.exit_code == 0, result.exception
    head = (tmp_path / "ctc.yaml").read_text().splitlines()[0]
    assert f"--sensors white_l1 --set {parameter} --ripple 0.05 -o" in head
    quiet, loud = (
        simulate(Flight(resolve(FlightPlan(gains=str(tmp_path), sensors=sensors, duration=5.0))))
        for sensors in ("ideal", "white_l1")
    )
    assert quiet.commanded_torque is not None
    assert loud.commanded_torque is not None
    noise = (loud.commanded_torque - quiet.commanded_torque)[2000:]
    asked = np.array([1.9, 4.2, 1.3, 1.1, 2.6, 4.0, 0.21, 0.35, 0.047])  # largest, 30 s
    share = noise.std(axis=0) / asked
    assert 0.03 < share.max() < 0.07


def test_ripple_of_a_robot_held_still_is_that_of_the_noise() -> None:
    """With the noise of L1, independent code found 0.027 N m on the base under TDE-STC."""
    found = report("--controller", "tde_stc", "--sensors", "white_l1")["laws"]["tde_stc"]
    assert np.mean(found["held_ripple"][:3]) == pytest.approx(0.027, rel=0.1)
    gain = np.array(found["noise_gain"]) * ([1e-6] * 3 + [1e-5] * 6)
    np.testing.assert_allclose(found["held_ripple"], gain, rtol=0.5)
    text = run("check", "--controller", "tde_stc", "--sensors", "white_l1").stdout
    assert "white_l1" in text


def test_a_law_that_diverges_held_still_has_no_ripple() -> None:
    options = ("--controller", "ctc", "--gains", "printed", "--sensors", "white_l1")
    assert report(*options)["laws"]["ctc"]["held_ripple"] is None
    assert "ctc diverged" in run("check", *options).stdout


def test_a_nominal_set_is_written_read_and_flown(tmp_path: Path) -> None:
    result = tune(tmp_path, "--h-bar", "nominal")
    assert result.exit_code == 0, result.exception
    for law in ("tde_smc", "tde_tsmc", "tde_stc"):
        assert "      h_bar: nominal\n" in (tmp_path / f"{law}.yaml").read_text()
    found = report("--gains", str(tmp_path), "--case", "4-2")["laws"]
    assert found["tde_stc"]["torque_scale_margin"] == pytest.approx(0.375, abs=5e-4)
    masses = report("--gains", str(tmp_path), "--mass-uncertainty", "0.1")["laws"]["indi"]
    assert masses["wrong_masses"]["smallest"] == pytest.approx(1.0 / 1.1)
    assert masses["wrong_masses"]["largest"] == pytest.approx(1.0 / 0.9)
    text = run("check", "--gains", str(tmp_path)).stdout
    assert "h_bar of indi, tde_smc, tde_stc, tde_tsmc is H_S of the nominal model" in text
    simulate(Flight(resolve(FlightPlan(gains=str(tmp_path), duration=0.1))))


def test_auto_says_why_it_takes_the_nominal_inertia(tmp_path: Path) -> None:
    result = tune(tmp_path, "--h-bar", "auto")
    assert result.exit_code == 0, result.exception
    assert "use the inertia of the nominal model (h_bar: nominal)" in result.stderr
    assert "eigenvalues of H_S^-1 h_bar would be 0.06 to 2.24" in result.stderr
    assert "h_bar: nominal" in (tmp_path / "tde_stc.yaml").read_text()


def test_laws_at_equal_ripple_have_it_in_flight(tmp_path: Path) -> None:
    """On the limiting axis, as it was asked for: 5 % of the largest force of the mission.

    INDI has the low-pass of the laws with switching terms, to which half of the variance is left.
    """
    noise = ("--sensors", "white_l1")
    result = tune(tmp_path, *noise, "--noise-ripple", "0.05", "--h-bar", "nominal")
    assert result.exit_code == 0, result.exception
    asked = np.array([1.27, 2.39, 0.832, 0.669, 1.39, 2.85, 0.117, 0.144, 0.034])  # case 1
    for law in ("ctc", "indi", "dob", "pd"):
        options = ("--controller", law, "--gains", str(tmp_path), *noise)
        held = np.array(report(*options)["laws"][law]["held_ripple"])
        share = 0.05 * (LINEAR_SHARE**0.5 if law == "indi" else 1.0)
        assert (held / asked).max() == pytest.approx(share, rel=0.15), law
