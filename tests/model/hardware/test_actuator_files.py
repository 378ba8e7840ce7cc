"""The files of config/actuators, and what is said of bad ones."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from paths import CONFIG

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

FILES = {path.stem: path for path in (CONFIG / "actuators").glob("*.yaml")}
ROBOTS = [Robot.from_yaml(CONFIG / f"robots/{name}.yaml") for name in ("paper", "seven_joint")]
PAPER = ROBOTS[0]
HARDWARE = "base_actuation: hardware, "
CROSS = "[1, 0, 0, 0, 1, 0, 0, 0, 1]"


def of(name: str, **overrides: Any) -> PlantNodeSettings:
    return PlantNodeSettings.resolve({"actuators": name, **overrides})


def test_there_are_the_files_that_the_manual_names() -> None:
    hardware = {
        *("wheels", "small_wheels", "thrusters", "wheels_and_thrusters", "wheels_and_torquers")
    }
    assert set(FILES) == {"ideal", "none", *hardware}


@pytest.mark.parametrize("robot", ROBOTS, ids=lambda robot: robot.name)
@pytest.mark.parametrize("name", FILES)
def test_a_file_is_about_the_base_alone_and_makes_a_plant(robot: Robot, name: str) -> None:
    sections = yaml.safe_load(FILES[name].read_text("utf-8"))
    assert set(sections) <= {"plant_node", "controller_node"}
    assert set(sections["plant_node"]["ros__parameters"]) <= set(BaseActuatorSettings.model_fields)
    assert set(sections.get("controller_node", {}).get("ros__parameters", {})) <= {"allocation"}
    settings = of(name, robot=robot.name, orbit="iss")
    plant = Plant(robot, settings, 5e-4)
    assert plant.names.actuators == settings.names
    assert of(str(FILES[name])).wheels == settings.wheels
    assert (name == "ideal") is (settings.base_actuation == "ideal")


@pytest.mark.parametrize(
    ("part", "key", "zero_is_allowed"),
    [
        *(("wheels", key, True) for key in ("max_torque", "max_momentum", "coulomb", "viscous")),
        ("wheels", "rotor_inertia", False),
        ("magnetic_torquers", "max_dipole", False),
        *(("thrusters", key, True) for key in ("shortest_pulse", "delay")),
        *(("thrusters", key, False) for key in ("force", "specific_impulse")),
    ],
)
def test_sizes_are_not_negative(part: str, key: str, zero_is_allowed: bool) -> None:
    """The smallest number below zero is refused, and named; zero only where it means something."""
    with pytest.raises(InputError, match=rf"{part}\.{key}"):
        PlantNodeSettings.resolve({f"{part}.{key}": [-5e-324]})
    if zero_is_allowed:
        PlantNodeSettings.resolve({f"{part}.{key}": [0.0]})
    else:
        with pytest.raises(InputError, match=rf"{part}\.{key}"):
            PlantNodeSettings.resolve({f"{part}.{key}": [0.0]})


def test_without_a_choice_the_base_is_ideal() -> None:
    assert PlantNodeSettings.resolve({}) == of("ideal")
    settings = of("ideal")
    ideal = BaseActuatorSettings()
    assert all(getattr(settings, name) == getattr(ideal, name) for name in type(ideal).model_fields)


@pytest.mark.parametrize("name", ["thrusters", "wheels_and_thrusters"])
def test_thrusters_come_in_couples(name: str) -> None:
    """Two give a torque about one axis and no force; six pairs, for both senses of each."""
    thrusters = of(name).thrusters
    forces = thrusters.unit_directions * thrusters.values("force")[:, None]
    torques = thrusters.torques
    np.testing.assert_array_equal(forces[0::2], -forces[1::2])
    np.testing.assert_array_equal(torques[0::2], torques[1::2])
    size = 2.0 * thrusters.values("force")[0]
    expected = [sign * size * axis for axis in np.eye(3) for sign in (1.0, -1.0)]
    np.testing.assert_allclose(torques[0::2] + torques[1::2], expected)


def test_single_numbers_come_over_those_of_the_file() -> None:
    settings = of("wheels", **{"wheels.max_torque": [1.0, 2.0, 3.0, 4.0]})
    assert settings.wheels.values("max_torque").tolist() == [1.0, 2.0, 3.0, 4.0]
    assert settings.wheels.axes == of("wheels").wheels.axes


@pytest.mark.parametrize(
    ("text", "why"),
    [
        ("wheel: {}", "wheel: unknown key, got {}: did you mean wheels"),
        (
            "wheels: {axis: [1]}",
            r"wheels.axis: unknown key, got \[1\]: choose one of axes, coulomb,"
            " initial_speed, max_momentum, max_torque, rotor_inertia, viscous ",
        ),
        ("base_actuation: wheels", "base_actuation: Input should be 'ideal', 'hardware' or 'none'"),
        (
            "wheels: {axes: [1, 0, 0, 0]}",
            r"wheels.axes: x, y, z of at most 8 vectors were expected,"
            r" or \[0.0\] for none: 4 numbers, got \[1, 0, 0, 0\]$",
        ),
        (
            "wheels: {axes: [1, 0, 0, 0, 0, 0]}",
            "wheels.axes: vector 2 must have a norm of 0.001 to 1000",
        ),
        ("wheels: {rotor_inertia: [-1]}", "wheels.rotor_inertia.0: Input should be greater than 0"),
        ("wheels: {rotor_inertia: []}", "wheels.rotor_inertia: List should have at least 1 item"),
        ("wheels: {max_torque: [.nan]}", "wheels.max_torque.0: Input should be "),
        ("wheels: [1]", r"wheels: a mapping was expected, got \[1\]"),
        (
            "thrusters: {directions: [0, 0, 0]}",
            "thrusters.directions: vector 1 must have a norm of",
        ),
        ("thrusters: {force: [0]}", "thrusters.force.0: Input should be greater than 0, got 0"),
        ("thrusters: {force: 4}", "thrusters.force: Input should be a valid list, got 4$"),
        (
            "magnetic_torquers: {dipole: [1]}",
            r"magnetic_torquers.dipole: unknown key, got \[1\]: choose one of axes, max_dipole ",
        ),
        (
            "magnetic_torquers: {axes: [1, 0, 0, 0]}",
            r"magnetic_torquers.axes: x, y, z of at most 6 vectors were expected,"
            r" or \[0.0\] for none: 4 numbers, got",
        ),
        (
            "magnetic_torquers: {axes: [0, 1, 0, 0, 0, 0]}",
            "magnetic_torquers.axes: vector 2 must have a norm of 0.001 to 1000",
        ),
        (
            "magnetic_torquers: {max_dipole: [.inf]}",
            "magnetic_torquers.max_dipole.0: Input should be ",
        ),
        (
            "magnetic_torquers: {max_dipole: 400}",
            "magnetic_torquers.max_dipole: Input should be a valid list, got 400$",
        ),
        ("thrusters: {propellant: -1}", "thrusters.propellant: Input should be greater than or"),
        ("thrusters: {force: [1], force: [1]}", "line 1: not YAML .the key 'force' occurs twice"),
    ],
)
def test_a_bad_number_is_one_line_with_file_and_key(tmp_path: Path, text: str, why: str) -> None:
    refuses(tmp_path, text, f"^{{path}}: {why}")


@pytest.mark.parametrize(
    ("text", "why"),
    [
        (HARDWARE, "base_actuation is hardware: no wheels.axes or thrusters.positions$"),
        ("wheels: {axes: [1, 0, 0]}", "wheels are for base_actuation hardware, got 'ideal'$"),
        ("base_actuation: none, thrusters: {positions: [1, 0, 0]}", "thrusters are for base_actu"),
        (
            "magnetic_torquers: {axes: [1, 0, 0]}",
            "magnetic_torquers are for base_actuation hardware, got 'ideal'$",
        ),
        (
            HARDWARE + f"magnetic_torquers: {{axes: {CROSS}}}",
            "magnetic_torquers unload wheels: there are no wheels.axes$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}}}, "
            f"magnetic_torquers: {{axes: {CROSS}, max_dipole: [1, 2]}}",
            "magnetic_torquers.max_dipole has 2 values, one for all or 3 are allowed: one per "
            "magnetic torquer$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}}}, magnetic_torquers: {{axes: {CROSS}}}",
            "magnetic_torquers need an orbit with a magnetic field: --orbit NAME, with "
            "magnetism.strength above 0$",
        ),
        (
            HARDWARE + "wheels: {axes: [1, 0, 0, 0, 1, 0, 1, 1, 0]}",
            "wheels.axes must span all directions: the wheels cannot produce all torques$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}, max_torque: [1, 2]}}",
            "wheels.max_torque has 2 values, one for all or 3 are allowed: one per wheel$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}, rotor_inertia: [1, 201, 1]}}",
            "wheels.rotor_inertia: the base's inertia must be larger than its rotors', without "
            "them "
            "its smallest principal moment is -1 kg m2$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}, rotor_inertia: [0.1], max_momentum: [1], "
            "initial_speed: [5, -20, 5]}",
            "wheels.initial_speed stores 2 N m s in wheel_2, max_momentum is 1$",
        ),
        (
            HARDWARE + f"wheels: {{axes: {CROSS}, rotor_inertia: [0.1, 0.1, 0.3], max_momentum: "
            "[0, 1, 2], initial_speed: [99, -10, 8]}",
            "wheels.initial_speed stores 2.4 N m s in wheel_3, max_momentum is 2$",
        ),
        (
            HARDWARE + "thrusters: {positions: [1, 0, 0], directions: [1, 0, 0, 0, 1, 0]}",
            "thrusters.directions are for 2 thrusters, thrusters.positions for 1$",
        ),
        (
            HARDWARE + "thrusters: {positions: [1, 0, 0], directions: [1, 0, 0]}",
            "thrusters.directions: no positive torque about x is possible with the thrusters$",
        ),
        (
            HARDWARE + "thrusters: {positions: [0, 1, 0], directions: [0, 0, 1], delay: [0, 0]}",
            "thrusters.delay has 2 values, one for all or 1 are allowed: one per thruster$",
        ),
        (
            HARDWARE + "wheels: {axes: [1, 0, 0, 0, 1, 0]}, "
            "thrusters: {positions: [1, 0, 0], directions: [0, 1, 0]}",
            "thrusters.directions: no negative torque about z is possible with the thrusters and "
            "wheels",
        ),
    ],
)
def test_numbers_that_do_not_fit_are_one_line_with_file_and_key(
    tmp_path: Path, text: str, why: str
) -> None:
    refuses(tmp_path, text, f"^actuators {{path}}: {why}")


def refuses(tmp_path: Path, text: str, why: str) -> None:
    path = tmp_path / "mine.yaml"
    path.write_text("plant_node: {ros__parameters: {" + text + "}}")
    with pytest.raises(InputError, match=why.replace("{path}", str(path))) as caught:
        Plant(PAPER, of(str(path)), 5e-4)
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize("name", ["none", "wheels", "thrusters"])
def test_a_limit_of_an_ideal_base_is_refused_with_any_other(name: str) -> None:
    with pytest.raises(InputError, match="base_torque_limit is for base_actuation ideal, got '"):
        Plant(PAPER, of(name, base_torque_limit=1.0), 5e-4)
    with pytest.raises(InputError, match="fault saturate_base is for base_actuation ideal, got '"):
        Plant(PAPER, of(name, faults=["saturate_base@1:0.5"]), 5e-4)


def test_a_name_that_is_none_is_told_with_those_there_are() -> None:
    with pytest.raises(InputError, match="unknown actuator 'best': choose one of ideal, none, sma"):
        of("best")


def test_wheels_and_thrusters_may_span_together() -> None:
    """Two wheels, and thrusters for the axis that lacks."""
    settings = of("thrusters", **{"wheels.axes": [1.0, 0.0, 0.0, 0.0, 1.0, 0.0]})
    flat = settings.thrusters.model_dump()
    about_z = {key: flat[key][24:] for key in ("positions", "directions")}
    given_settings = {
        "base_actuation": "hardware",
        "wheels": settings.wheels.model_dump(),
        "thrusters": {**flat, **about_z},
    }
    BaseActuatorSettings.model_validate(given_settings).check(PAPER, "mine")


KEYS = [name for name, _ in leaves(BaseActuatorSettings)]
_NUMBERS = st.lists(st.integers(-2, 2) | st.floats(-1e3, 1e3), max_size=12)
_LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | _NUMBERS
_VALUES = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=8,
)
_SOME = st.dictionaries(
    st.sampled_from([*KEYS, "wheels", "thrusters", "magnetic_torquers"]) | st.text(max_size=9),
    _VALUES,
    max_size=4,
)


@given(_SOME, st.sampled_from(sorted(FILES)))
def test_any_file_makes_actuators_or_one_line(content: dict[str, Any], name: str) -> None:
    """Whatever stands in it, alone or over a good one: what cannot be flown is refused."""
    content.pop("actuators", None)
    try:
        settings = PlantNodeSettings.resolve({"actuators": name, "orbit": "iss", **content})
        settings.check(PAPER, name)
        Plant(PAPER, settings, 5e-4)
    except InputError as error:
        said = str(error)
    else:
        said = ""
    assert "\n" not in said
