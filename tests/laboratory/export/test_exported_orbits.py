"""Flight software for a robot in orbit as C: with magnetic torquers, and unaware of gears."""

from __future__ import annotations

import re
import shutil
import subprocess
from itertools import islice
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run
from exported_kernels import needs_compiler
from robots import driven_paper

from space_robot.export.folder import write_folder
from space_robot.export.recorded import recorded_flights
from space_robot.export.software import export
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_control.flight_code.folder import Exported
from space_robot_model.robot import Robot
from space_robot_msgs_py.bag.flight_log import FlightLog

TORQUERS: dict[str, Any] = {"actuators": "wheels_and_torquers", "orbit": "iss"}
GEARS: dict[str, Any] = {
    "plant_robot": Robot.from_dict(driven_paper()),
    "orbit": "iss",
    "sensors": "fine",
    "navigation": "filtered",
    "swaps": ["0.05:tde_smc"],
}
"""A plant of which the flight software, for the rigid robot in free space, knows nothing."""
needs_make = pytest.mark.skipif(
    not (shutil.which("make") and shutil.which("gcc")), reason="make or gcc is not installed"
)


def exported(**options: Any) -> Exported:
    return export(Flight(resolve(FlightPlan.model_validate(options))))


def verified(folder: Path, flights: int, **options: Any) -> dict[str, int]:
    """Write a folder with the first recorded flights and return the states that C answers."""
    code = exported(**options)
    plan = FlightPlan.model_validate(options)
    write_folder(folder, code, islice(recorded_flights(plan, code, (), 0.1), flights))
    command = ["make", "--no-print-directory", "-C", str(folder), "COMPILERS=gcc"]
    run = subprocess.run(command, capture_output=True, text=True, check=False)
    assert run.returncode == 0, run.stdout + run.stderr
    assert "warning" not in run.stderr
    lines = re.findall(r"acceptance/(\w+)\.bin: (\d+) states answered, every bit equal", run.stdout)
    return {name: int(count) for name, count in lines}


@needs_make
def test_torquers_are_commanded_to_the_bit(tmp_path: Path) -> None:
    """The scenario, faults and a wheel that fails, and hostile states and fields."""
    states = verified(tmp_path / "code", 3, **TORQUERS)
    assert states.keys() == {"mission", "faults_tde_stc", "hostile"}
    assert states["mission"] == 200
    assert states["faults_tde_stc"] > 1500
    assert states["hostile"] > 5000
    header = (tmp_path / "code/include/space_robot_flight.h").read_text("utf-8")
    assert "#define SPACE_ROBOT_TORQUERS 3\n" in header
    assert "#define SPACE_ROBOT_COMMANDED 16\n" in header
    assert "double magnetic_field[3];" in header
    assert "dipoles of the magnetic torquers, A m2" in header
    assert "3 magnetic torquers" in (tmp_path / "code/README.md").read_text("utf-8")
    parameters = (tmp_path / "code/parameters.h").read_text("utf-8")
    assert "controller.allocation.torquers.gain: k, 1/s." in parameters
    allocation = (tmp_path / "code/src/allocation.c").read_text("utf-8")
    assert (
        "Python: dump_momentum, space_robot_control/allocation/magnetic_torquers.py" in allocation
    )


@needs_make
def test_gears_and_orbit_of_the_plant_are_answered_to_the_bit(tmp_path: Path) -> None:
    """With filtered navigation and a swap; in the second flight states are lost, late and wrong.

    Not with computed torque: without the motors' inertia its model is so wrong that it diverges
    when states are late.
    """
    states = verified(tmp_path / "code", 2, **GEARS)
    assert states.keys() == {"mission", "faults_tde_stc"}
    assert states["mission"] == 200
    assert states["faults_tde_stc"] > 1500


def test_gears_and_orbit_of_the_plant_are_no_part_of_the_flight_software() -> None:
    """Its files are those for the rigid robot in free space, but for the scenario's digest."""
    rigid = {key: GEARS[key] for key in ("sensors", "navigation", "swaps")}
    one, other = exported(**GEARS), exported(**rigid)
    assert one.digest != other.digest
    assert one.sources.keys() == other.sources.keys()
    for path, text in one.sources.items():
        assert text.replace(one.digest, other.digest) == other.sources[path], path


def flown(**options: Any) -> FlightLog:
    return simulate(Flight(resolve(FlightPlan.model_validate({"duration": 0.2, **options}))))


@needs_compiler
@pytest.mark.parametrize("options", [TORQUERS, GEARS], ids=["torquers", "gears"])
def test_a_flight_under_c_has_the_same_bits(options: dict[str, Any]) -> None:
    """The flight software in C in the controller's place, also while states are not usable."""
    hard = {**options, "case": "3", "faults": ["nan_state@0.12-0.13:0.5", "drop_state@0.15-0.16"]}
    python, in_c = flown(**hard), flown(**hard, controller_code="c")
    for name, column in python.columns.items():
        np.testing.assert_array_equal(in_c.columns[name], column, name)
    assert bool(python.actuator_commands.any()) is (options is TORQUERS)


@pytest.mark.parametrize("way", ["option", "scenario"])
def test_the_command_exports_what_flies_in_an_orbit(
    way: str, tmp_path: Path, space_robot: Run
) -> None:
    """As all commands that fly do; torquers cannot be exported otherwise."""
    words = ["--orbit", "iss", "--actuators", "wheels_and_torquers"]
    if way == "scenario":
        file = tmp_path / "scenario.yaml"
        file.write_text("orbit: iss\nactuators: wheels_and_torquers\n")
        words = ["--scenario", str(file)]
    ran = space_robot("export", "-o", tmp_path / "code", *words, "--acceptance-seconds", "0.05")
    assert ran.code == 0, ran.err
    header = (tmp_path / "code/include/space_robot_flight.h").read_text("utf-8")
    assert "#define SPACE_ROBOT_TORQUERS 3\n" in header
