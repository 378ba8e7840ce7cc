"""``space-robot gains check`` of a robot with gears: springs, stability, what fails."""

from __future__ import annotations

import json
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from click.testing import CliRunner, Result
from paths import CONFIG
from robots import geared_paper_arm

from space_robot.cli.main import cli
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.flexible import FlexibleMotions, check_flexible, joint_frequencies
from space_robot.tuning.inertia import sampled_reference
from space_robot_control.laws import laws
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import SpaceRobotError

JOINTS = [f"joint{number}" for number in range(1, 7)]
WAYPOINT_TIMES = [0.0, 2.0, 4.0]
"""s."""
OBSERVERS = {"adrc", "dob", "indi"}
"""Laws with an estimate other than TDE."""


def robot_file(folder: Path, encoder: str, **changes: Any) -> str:
    """Write the paper's robot with the gears of `geared_paper_arm`; return the file's path."""
    content = yaml.safe_load((CONFIG / "robots" / "paper.yaml").read_text("utf-8"))
    gears = geared_paper_arm(Robot.from_dict(content), **changes).gears
    for link, gear in zip(content["robot"]["links"], gears, strict=True):
        assert gear
        link["drive"] = {
            "rotor_inertia": gear.rotor_inertia,
            "gear_ratio": gear.ratio,
            "stiffness": gear.stiffness,
            "damping": gear.damping,
            "encoder": encoder,
        }
    path = folder / f"{encoder}.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    return str(path)


@cache
def check(*options: str) -> Result:
    runner = CliRunner(env={"COLUMNS": "80"})
    return runner.invoke(cli, ["gains", "check", "--gains", "robust", *options])


@pytest.fixture(scope="module")
def motor(tmp_path_factory: pytest.TempPathFactory) -> str:
    """A plant whose motors are as heavy as the links and seen by the laws."""
    return robot_file(tmp_path_factory.mktemp("geared"), "motor")


@pytest.fixture(scope="module")
def link(tmp_path_factory: pytest.TempPathFactory) -> str:
    """One whose links are seen, through soft springs."""
    return robot_file(tmp_path_factory.mktemp("geared"), "link", damping=5.0)


def on(path: str, *options: str) -> Result:
    """Check laws of the paper's robot on another plant, on a quick pass of its mission."""
    quick = ("--set", f"mission.waypoint_times={WAYPOINT_TIMES}")
    return check("--robot", "paper", "--plant-robot", path, *quick, *options)


def test_springs_and_laws_are_in_the_report(motor: str) -> None:
    """With motors as heavy as the links, seen by the laws, nothing grows but the estimate with H_S.

    Within a tick a motor is moved without its link: h_bar is below twice its inertia, H_S is not.
    """
    result = on(motor, "--json")
    assert str(result.exception) == "indi: small oscillations of the gears' springs grow"
    report = json.loads(result.stdout)
    assert report["is_sound"] is False
    assert report["robot"] == "paper"
    assert list(report["gears"]) == JOINTS
    for extremes in report["gears"].values():
        assert list(extremes) == ["lowest_hz", "highest_hz"]
        assert 1.0 < extremes["lowest_hz"] <= extremes["highest_hz"] < 100.0
    assert list(report["laws"]) == sorted(laws())
    for name, law in report["laws"].items():
        flexible = law["flexible"]
        assert list(flexible) == ["is_stable", "radius", "largest_corner_hz", "largest_h_bar_scale"]
        assert flexible["is_stable"] is (name != "indi")
        assert law["is_sound"] is (name != "indi")
        assert 0.9 < flexible["radius"] < 2.5
        if name.startswith("tde"):
            assert flexible["largest_corner_hz"] > 100.0
        elif name == "indi":
            assert 1.0 < flexible["largest_corner_hz"] < 63.0  # of the set
        else:
            assert flexible["largest_corner_hz"] is None
        if name.startswith("tde") or name in OBSERVERS:
            assert (flexible["largest_h_bar_scale"] > 1.0) is (name != "indi")
        else:
            assert flexible["largest_h_bar_scale"] is None


def test_numbers_are_those_of_the_functions(motor: str) -> None:
    """Along the mission, in configurations a second apart."""
    report = json.loads(on(motor, "--controller", "tde_stc", "--json").stdout)
    quick = {"mission": {"waypoint_times": WAYPOINT_TIMES}}
    flight = Flight(resolve(FlightPlan(gains="robust", plant_robot=motor, parameters=quick)))
    robot = flight.plant.robot
    positions = sampled_reference(robot, flight.mission_settings, 1.0).joints[:, 0]
    assert len(positions) == 5
    frequencies = joint_frequencies(robot, positions)
    for k, name in enumerate(JOINTS):
        expected = {"lowest_hz": frequencies[:, k].min(), "highest_hz": frequencies[:, k].max()}
        assert report["gears"][name] == pytest.approx(expected, rel=1e-12)
    corner = flight.controller_settings.acceleration_filter_hz
    motions = FlexibleMotions(robot, positions, flight.law.period, True)
    expected = check_flexible(flight.law, motions, corner)
    flexible = report["laws"]["tde_stc"]["flexible"]
    assert flexible["radius"] == pytest.approx(expected.radius, rel=1e-12)
    assert flexible["largest_h_bar_scale"] == expected.largest_h_bar_scale


def test_tables_say_the_same(motor: str) -> None:
    report, text = json.loads(on(motor, "--json").stdout), on(motor).stdout
    assert "Frequency of each gear's" in text
    assert "Stability with the springs of the gears along the" in text
    for name, extremes in report["gears"].items():
        (row,) = [line for line in text.splitlines() if name in line and "." in line][:1]
        cells = [cell.strip() for cell in row.strip("│").split("│")]
        assert cells == [name, *(f"{value:.3f}" for value in extremes.values())]
    stability = text[text.index("Stability with the springs") :]
    for name, law in report["laws"].items():
        row = next(line for line in stability.splitlines() if name in line.split())
        flexible = law["flexible"]
        scale = flexible["largest_h_bar_scale"]
        cells = [cell.strip() for cell in row.strip("│").split("│")]
        corner = flexible["largest_corner_hz"]
        expected = [
            "-" if corner is None else f"{corner:.3g} Hz",
            "-" if scale is None else f"{scale:.3g}",
        ]
        verdict = "holds" if flexible["is_stable"] else "fails"
        assert cells == [name, f"{flexible['radius']:.6f} {verdict}", *expected]
    assert "…" not in text


def test_what_grows_is_named_with_exit_code_1(link: str) -> None:
    """Links seen through soft springs: with laws that have a margin without gears."""
    result = on(link, "--json")
    assert isinstance(result.exception, SpaceRobotError)
    assert result.exception.exit_code == 1
    report = json.loads(result.stdout)
    growing = [name for name, law in report["laws"].items() if not law["flexible"]["is_stable"]]
    assert set(growing) >= {"tde_smc", "tde_stc", "tde_tsmc"}
    message = f"{', '.join(growing)}: small oscillations of the gears' springs grow"
    assert str(result.exception) == message
    assert report["is_sound"] is False
    for name, law in report["laws"].items():
        assert law["is_sound"] is (name not in growing)
        assert (law["flexible"]["radius"] > 1.0) is (name in growing)
    text = on(link, "--controller", "ctc_smc").stdout
    stability = text.partition("Stability with the springs")[2]
    row = next(line for line in stability.splitlines() if "ctc_smc" in line.split())
    assert ("fails" in row) is ("ctc_smc" in growing)


def test_both_faults_are_told_in_one_line(link: str) -> None:
    result = on(link, "--gains", "printed", "--controller", "ctc")
    assert str(result.exception) == (
        "ctc: small motions grow; ctc: small oscillations of the gears' springs grow"
    )


def test_the_largest_bandwidth_is_one_with_which_a_law_passes(tmp_path: Path) -> None:
    path = robot_file(tmp_path, "link", stiffness=1e5, damping=50.0)
    law = ("--controller", "tde_stc")
    corner = json.loads(on(path, *law, "--json").stdout)["laws"]["tde_stc"]["flexible"][
        "largest_corner_hz"
    ]
    assert corner > 0.0
    for factor, code in ((0.99, 0), (1.05, 1)):
        key = f"controller.acceleration_filter_hz={factor * corner:.6g}"
        result = on(path, *law, "--set", key)
        assert result.exit_code == code, result.exception


def test_the_base_may_float_freely(motor: str) -> None:
    held, free = (
        json.loads(on(motor, "--controller", "ctc", "--actuators", actuators, "--json").stdout)
        for actuators in ("ideal", "none")
    )
    assert free["gears"] == held["gears"]
    assert free["laws"] != held["laws"]


def test_tuned_gains_pass_the_check(motor: str, tmp_path: Path) -> None:
    """A law that met the motors with the inertia of the links would grow at once."""
    tuned = CliRunner().invoke(
        cli, ["gains", "tune", "--robot", motor, "--mission", "paper", "-o", str(tmp_path)]
    )
    assert tuned.exit_code == 0, tuned.exception
    mission = ("--mission", "paper", "--gains", str(tmp_path) + "/")
    assert check("--robot", motor, *mission).exit_code == 0


def test_of_rigid_joints_nothing_is_said_of_springs() -> None:
    result = check("--json")
    assert result.exit_code == 0
    report = json.loads(result.stdout)
    assert "gears" not in report
    assert not any("flexible" in law for law in report["laws"].values())
    text = check().stdout
    assert "spring" not in text
    assert "gear" not in text
