"""Magnetic torquers in a file of actuators: their names and numbers, and what they need to fly."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_control.allocation.assumed_actuators import assumed_actuators
from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.hardware.magnetic_torquers import MagneticTorquerSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_TORQUERS, RobotNames
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

PAPER = Robot.from_yaml(CONFIG / "robots/paper.yaml")
CROSS = np.eye(3).ravel().tolist()
TORQUERS = ("torquer_1", "torquer_2", "torquer_3")


def hardware(**parts: Any) -> BaseActuatorSettings:
    return BaseActuatorSettings.model_validate({"base_actuation": "hardware", **parts})


def test_by_default_there_are_none() -> None:
    settings = BaseActuatorSettings()
    assert settings.torquer_count == 0
    assert settings.names == ()
    assert settings.magnetic_torquers.unit_axes.shape == (0, 3)
    assert settings.magnetic_torquers.largest.shape == (0,)


@given(st.integers(0, 8), st.integers(0, 24), st.integers(0, MOST_TORQUERS))
def test_names_are_numbered_wheels_first_and_torquers_last(
    wheels: int, thrusters: int, torquers: int
) -> None:
    """A command has its numbers in this order."""

    def axes(count: int) -> list[float]:
        return [1.0, 0.0, 0.0] * count or [0.0]

    settings = hardware(
        wheels={"axes": axes(wheels)},
        thrusters={"positions": axes(thrusters), "directions": axes(thrusters)},
        magnetic_torquers={"axes": axes(torquers)},
    )
    names = settings.robot_names(PAPER)
    kinds = (names.wheels, names.thrusters, names.torquers)
    for kind, name, count in zip(
        kinds, ("wheel", "thruster", "torquer"), (wheels, thrusters, torquers), strict=True
    ):
        assert kind == tuple(f"{name}_{k + 1}" for k in range(count))
    assert settings.names == names.actuators == names.wheels + names.thrusters + names.torquers
    assert names.commanded == (*names.axes, *names.actuators)
    again = RobotNames.of(
        PAPER.joint_names, settings.names, wheels, torquer_count=settings.torquer_count
    )
    assert again == names


def test_axes_are_directions_and_one_dipole_may_stand_for_all() -> None:
    axes = [3.0, 0.0, 4.0, 0.0, -0.1, 0.0]
    same = MagneticTorquerSettings(axes=axes, max_dipole=[30.0])
    np.testing.assert_array_equal(same.unit_axes, [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]])
    np.testing.assert_array_equal(same.largest, [30.0, 30.0])
    each = MagneticTorquerSettings(axes=axes, max_dipole=[30.0, 20.0])
    np.testing.assert_array_equal(each.largest, [30.0, 20.0])


def test_too_many_are_refused() -> None:
    MagneticTorquerSettings(axes=CROSS * 2)
    with pytest.raises(ValueError, match="x, y, z of at most 6 vectors were expected"):
        MagneticTorquerSettings(axes=CROSS * 2 + [1.0, 0.0, 0.0])


def test_the_file_has_large_torquers_and_the_wheels_of_the_other_file() -> None:
    settings = PlantNodeSettings.resolve({"actuators": "wheels_and_torquers", "orbit": "iss"})
    wheels = PlantNodeSettings.resolve({"actuators": "wheels"}).wheels
    assert settings.names[-3:] == TORQUERS
    np.testing.assert_array_equal(settings.magnetic_torquers.unit_axes, np.eye(3))
    np.testing.assert_array_equal(settings.magnetic_torquers.largest, np.full(3, 400.0))
    assert settings.wheels == wheels.model_copy(
        update={"initial_speed": settings.wheels.initial_speed}
    )
    stored = settings.wheels.spin_momenta(settings.wheels.values("initial_speed"))
    np.testing.assert_allclose(stored, 0.25 * settings.wheels.values("max_momentum"), rtol=0.01)


def test_the_flight_software_needs_no_orbit_to_know_its_torquers() -> None:
    """Only the plant does: the controller reads a magnetometer."""
    assert assumed_actuators("wheels_and_torquers", PAPER).names[-3:] == TORQUERS


@pytest.mark.parametrize(
    "orbit",
    [
        {},
        {"orbit": "none"},
        {"orbit": "iss", "magnetism.strength": 0.0},
        {"orbital_elements.height": 420e3},
    ],
)
def test_a_plant_without_a_magnetic_field_refuses_them(orbit: dict[str, Any]) -> None:
    settings = PlantNodeSettings.resolve({"actuators": "wheels_and_torquers", **orbit})
    with pytest.raises(InputError) as caught:
        Plant(PAPER, settings, 5e-4)
    assert str(caught.value) == (
        "actuators wheels_and_torquers: magnetic_torquers need an orbit with a magnetic field: "
        "--orbit NAME, with magnetism.strength above 0"
    )


def test_a_field_may_come_from_a_file_or_from_numbers() -> None:
    for orbit in (
        {"orbit": "gto"},
        {"orbital_elements.height": 420e3, "magnetism.strength": 1e-12},
    ):
        settings = PlantNodeSettings.resolve({"actuators": "wheels_and_torquers", **orbit})
        plant = Plant(PAPER, settings, 5e-4)
        assert plant.names.torquers == TORQUERS
        assert plant.names.commanded[-3:] == TORQUERS
        assert np.linalg.norm(plant.state.magnetic_field) > 0.0


def test_the_file_flies_in_an_orbit(space_robot: Run) -> None:
    words = ("--actuators", "wheels_and_torquers", "--duration", "0.05")
    ran = space_robot("simulate", *words, "--orbit", "iss")
    assert ran.code == 0, ran.err


@pytest.mark.parametrize("more", [(), ("--set", "plant.orbital_elements.height=400e3")])
def test_without_a_field_the_command_ends_with_one_line(
    space_robot: Run, more: tuple[str, ...]
) -> None:
    words = ("--actuators", "wheels_and_torquers", "--duration", "0.05")
    ran = space_robot("simulate", *words, *more)
    assert (ran.code, ran.out) == (2, "")
    assert ran.err.count("\n") == 1
    assert "actuators wheels_and_torquers: magnetic_torquers need an orbit" in ran.err


def test_a_file_of_torquers_alone_is_refused_by_the_command(
    space_robot: Run, tmp_path: Path
) -> None:
    file = tmp_path / "mine.yaml"
    file.write_text(
        "plant_node: {ros__parameters: {base_actuation: hardware, magnetic_torquers: "
        "{axes: [1.0, 0.0, 0.0]}}}"
    )
    ran = space_robot("simulate", "--actuators", file, "--orbit", "iss")
    assert (ran.code, ran.out) == (2, "")
    assert ran.err == (
        f"space-robot: error: actuators {file}: magnetic_torquers unload wheels: there are no "
        "wheels.axes\n"
    )


def test_plant_and_controller_must_have_the_same_number() -> None:
    with pytest.raises(InputError, match=r"4 wheels, 0 thrusters, 3 magnetic torquers") as caught:
        resolve(
            FlightPlan(actuators="wheels_and_torquers", orbit="iss", assumed_actuators="wheels")
        )
    assert "\n" not in str(caught.value)


def test_the_flight_software_may_assume_other_torquers() -> None:
    """Weaker ones, on other axes."""
    own = assumed_actuators("wheels_and_torquers", PAPER).model_dump()
    own["magnetic_torquers"] = {"axes": [0.0, 1.0, 0.0, *CROSS[:3], *CROSS[6:]], "max_dipole": [9]}
    plan = FlightPlan(actuators="wheels_and_torquers", orbit="iss", assumed_actuators=own)
    flight = Flight(resolve(plan))
    torquers = flight.controller.block[0].allocation.torquers
    np.testing.assert_array_equal(torquers.max_dipole[:3], np.full(3, 9.0))
    np.testing.assert_array_equal(torquers.axis[0], [0.0, 1.0, 0.0])
    assert flight.plant.memory.actuators.magnetic_torquers.max_dipole[0] == 400.0
