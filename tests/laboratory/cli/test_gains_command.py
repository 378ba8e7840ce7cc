"""``space-robot gains``: what it prints, tunes and refuses, with gears too; the shipped sets."""

from __future__ import annotations

import json
import shlex
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from click.testing import CliRunner, Result
from flights import planned, simulated
from paths import CONFIG
from robots import geared_paper_arm

from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.row import Task
from space_robot.campaign.study import Study, read_study
from space_robot.cli.main import cli
from space_robot_control.controller.settings import ControllerNodeSettings
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_model.robot.find import robot_names
from space_robot_msgs_py.errors import InputError, SpaceRobotError


def run(*arguments: str, columns: int = 80) -> Result:
    return CliRunner(env={"COLUMNS": str(columns)}).invoke(cli, ["gains", *arguments])


def report(*arguments: str) -> dict[str, Any]:
    found: dict[str, Any] = json.loads(run("check", *arguments, "--json").stdout)
    return found


def test_an_estimate_that_diverges_is_a_failure() -> None:
    result = run("check", "--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[1e4]")
    assert isinstance(result.exception, SpaceRobotError)
    assert result.exception.exit_code == 1
    assert str(result.exception).startswith("tde_stc: the estimate diverges")
    assert "remark" not in result.stderr


def test_a_free_base_leaves_the_joints_to_be_judged() -> None:
    """Table IV: seven times the margin, so that it is sound; the base gets no torque of noise."""
    free = ("--actuators", "none")
    result = run("check", *free, "--controller", "tde_stc")
    assert result.exit_code == 0
    assert "H_f^-1 h_bar" in result.stdout
    found = report(*free)
    assert found["actuators"] == "none"
    stc = found["laws"]["tde_stc"]
    assert stc["torque_scale_margin"] == pytest.approx(0.0237, abs=5e-5)
    for law in found["laws"].values():
        assert law["noise_gain"][:3] == [0.0] * 3
    assert stc["noise_gain"][3:6] == pytest.approx([5.0 / 5e-4 + 5.0] * 3)
    turned = ("--controller", "ctc", "--set", "mission.base_quaternion=[0.0, 1.0, 0.0, 0.0]")
    again = report(*free, *turned)["laws"]["ctc"]
    assert again["noise_gain"] == found["laws"]["ctc"]["noise_gain"]


def test_parameters_count_as_in_a_flight() -> None:
    one = report("--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[0.5]")
    two = report("--controller", "tde_stc", "--set", "controller.tde_stc.h_bar=[1.0]")
    smallest = [found["laws"]["tde_stc"]["smallest_eigenvalue"] for found in (one, two)]
    assert smallest[1] == pytest.approx(2.0 * smallest[0])
    heavy = report("--controller", "tde_stc", "--case", "4-2")["laws"]["tde_stc"]
    assert heavy["torque_scale_margin"] == pytest.approx(0.0023, abs=5e-5)


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
    result = tune(tmp_path, *inspection, "--orbit", "iss", "--period", "0.005")
    assert result.exit_code == 0, result.exception
    text = (tmp_path / "ctc.yaml").read_text("utf-8")
    assert "--orbit iss --period 0.005" in text
    gains = yaml.safe_load(text)["controller_node"]["ros__parameters"]["ctc"]
    assert gains["k_p"] == [(0.05 / 0.005) ** 2]  # margin by period


def test_a_set_for_segments_is_in_the_bag_and_may_be_overruled(tmp_path: Path) -> None:
    """Also what it says to the controller."""
    assert tune(tmp_path, "--mission", "line").exit_code == 0
    flight = planned(gains=str(tmp_path))
    corner = flight.controller_settings.acceleration_filter_hz
    recorded = flight.description["scenario"]["parameters"]["controller"]
    assert recorded["acceleration_filter_hz"] == corner > 0.0
    given = {"controller": {"acceleration_filter_hz": 7.0}}
    over = planned(gains=str(tmp_path), parameters=given)
    assert over.controller_settings.acceleration_filter_hz == 7.0
    alone = ControllerNodeSettings.resolve({"gains": str(tmp_path)})  # as a node by itself has it
    assert alone.acceleration_filter_hz == corner
    here = "mission.joints_deg=[0.0, 90.0, 200.0, 20.0, 30.0, 10.0]"
    still = tune(tmp_path, "--set", "mission.segments=['']", "--set", here)
    assert "moves neither joints nor base" in str(still.exception)


def test_ripple_of_a_robot_held_still_is_that_of_the_noise() -> None:
    """With the noise of L1, independent code found 0.027 N m on the base under TDE-STC."""
    found = report("--controller", "tde_stc", "--sensors", "white_l1")["laws"]["tde_stc"]
    assert np.mean(found["held_ripple"][:3]) == pytest.approx(0.027, rel=0.1)
    gain = np.array(found["noise_gain"]) * ([1e-6] * 3 + [1e-5] * 6)
    np.testing.assert_allclose(found["held_ripple"], gain, rtol=0.5)


def test_laws_with_the_nominal_inertia_are_checked_as_such_and_fly(tmp_path: Path) -> None:
    result = tune(tmp_path, "--h-bar", "nominal")
    assert result.exit_code == 0, result.exception
    for law in ("tde_smc", "tde_tsmc", "tde_stc"):
        assert "      h_bar: nominal\n" in (tmp_path / f"{law}.yaml").read_text()
    own = ("--gains", str(tmp_path))
    heavy = report(*own, "--case", "4-2", "--controller", "tde_stc")["laws"]["tde_stc"]
    assert heavy["torque_scale_margin"] == pytest.approx(0.375, abs=5e-4)
    masses = report(*own, "--controller", "indi", "--mass-uncertainty", "0.1")["laws"]["indi"]
    assert masses["wrong_masses"]["smallest"] == pytest.approx(1.0 / 1.1)
    assert masses["wrong_masses"]["largest"] == pytest.approx(1.0 / 0.9)
    text = run("check", *own).stdout
    assert "h_bar of indi, tde_smc, tde_stc, tde_tsmc is H_S of the nominal model" in text
    simulated(gains=str(tmp_path), duration=0.05)


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> str:
    """The paper's robot with motors as heavy as the links and seen by the laws."""
    content = yaml.safe_load((CONFIG / "robots" / "paper.yaml").read_text("utf-8"))
    gears = geared_paper_arm(Robot.from_dict(content)).gears
    for link, gear in zip(content["robot"]["links"], gears, strict=True):
        assert gear
        link["drive"] = {
            "rotor_inertia": gear.rotor_inertia,
            "gear_ratio": gear.ratio,
            "stiffness": gear.stiffness,
            "damping": gear.damping,
            "encoder": "motor",
        }
    path = tmp_path_factory.mktemp("geared") / "motor.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    return str(path)


def check_gears(*options: str) -> Result:
    return run("check", "--gains", "robust", *options)


def test_springs_and_laws_are_in_the_report(motor: str) -> None:
    """With motors as heavy as the links, seen by the laws, nothing grows but the estimate with H_S.

    Within a tick a motor is moved without its link: h_bar is below twice its inertia, H_S is not.
    """
    goals = (15, 110, 185, 45, 10, -25), (30, 100, 150, 90, 30, -50)
    segments = [f"{{joints_deg: {list(goal)}, duration: 2}}" for goal in goals]
    quick = ("--set", f"mission.segments={json.dumps(segments)}")
    result = check_gears("--robot", "paper", "--plant-robot", motor, *quick, "--json")
    assert str(result.exception) == "indi: small oscillations of the gears' springs grow"
    report = json.loads(result.stdout)
    assert report["is_sound"] is False
    assert report["robot"] == "paper"
    assert list(report["gears"]) == [f"joint{number}" for number in range(1, 7)]
    for extremes in report["gears"].values():
        assert 1.0 < extremes["lowest_hz"] <= extremes["highest_hz"] < 100.0
    assert list(report["laws"]) == sorted(laws())
    for name, law in report["laws"].items():
        flexible, is_indi, is_tde = law["flexible"], name == "indi", name.startswith("tde")
        assert list(flexible) == ["is_stable", "radius", "largest_corner_hz", "largest_h_bar_scale"]
        assert flexible["is_stable"] is law["is_sound"] is not is_indi
        assert 0.9 < flexible["radius"] < 2.5
        corner, scale = flexible["largest_corner_hz"], flexible["largest_h_bar_scale"]
        assert (corner is None) == (not is_tde and not is_indi)
        if corner is not None:
            assert corner > 100.0 if is_tde else 1.0 < corner < 63.0  # of the set
        assert (scale is None) == (not is_tde and name not in ("adrc", "dob", "indi"))
        if scale is not None:
            assert (scale > 1.0) is not is_indi


def test_tuned_gains_pass_the_check(motor: str, tmp_path: Path) -> None:
    """A law that met the motors with the inertia of the links would grow at once."""
    tuned = tune(tmp_path, "--robot", motor, "--mission", "paper")
    assert tuned.exit_code == 0, tuned.exception
    given = ("--robot", motor, "--mission", "paper", "--gains", f"{tmp_path}/")
    assert run("check", *given).exit_code == 0


def files(folder: Path) -> dict[str, list[str]]:
    return {file.name: file.read_text("utf-8").splitlines() for file in folder.glob("*.yaml")}


@pytest.mark.parametrize(
    ("robot", "gains"),
    [
        ("paper", "robust"),
        ("paper", "nominal"),
        pytest.param("seven_joint", "robust", marks=pytest.mark.docs),
        pytest.param("ets_vii", "robust", marks=pytest.mark.docs),
        *((robot, "tuned") for robot in robot_names() if robot not in ("paper", "seven_joint")),
    ],
)
def test_the_command_in_the_files_makes_them(robot: str, gains: str, tmp_path: Path) -> None:
    shipped = files(CONFIG / "gains" / robot / gains)
    line = shipped["tde_stc.yaml"][0]
    program, *words, _, _ = shlex.split(line.removeprefix("# Made by `").removesuffix("`."))
    assert program == "space-robot"
    result = CliRunner().invoke(cli, [*words, "-o", str(tmp_path)])
    assert result.exit_code == 0, result.exception
    made = files(tmp_path)
    assert made.keys() == shipped.keys()
    for name, lines in made.items():
        assert lines[1:] == shipped[name][1:], name
        assert shipped[name][0] == line


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
@pytest.mark.parametrize("case", ["1", "4-2"])
def test_it_is_sound(robot: str, case: str) -> None:
    """But for the nominal inertia of robot seven_joint, whose light wrist the payload outweighs."""
    result = check_gears("--robot", robot, "--case", case)
    assert result.exit_code == 0, result.exception
    is_thin = (robot, case) == ("seven_joint", "4-2")
    remark = "remark: indi: the nominal inertia leaves a margin below 2% in torque scale\n"
    assert result.stderr == (remark if is_thin else "")


@pytest.mark.parametrize("law", sorted(laws()))
@pytest.mark.parametrize(("case", "echo"), [("3", 1.02), ("4-2", 0.98)])
def test_all_laws_fly_with_what_reality_brings(law: str, case: str, echo: float) -> None:
    """Fine sensors, filtered navigation, masses within 20 %, 2 % too much or too little torque."""
    scenario = {
        "case": case,
        "sensors": "fine",
        "navigation": "filtered",
        "duration": 5.0,
        "parameters": {"plant": {"echo_scale": [echo]}},
    }
    off = {k: v for k, v in read_study("sensor_grades").vary.items() if k.startswith("robot.")}
    study = Study.model_validate({"scenario": scenario, "laws": [f"{law}=robust"], "vary": off})
    row = RowFlyer.of(study, 1, 1)(Task(0, f"{law}=robust"))
    assert row.is_complete
    assert row.metrics["attitude.rms"] < 1e-3
    assert row.metrics["joints_4_6.rms"] < 0.05
