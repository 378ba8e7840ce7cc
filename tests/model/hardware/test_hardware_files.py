"""Files of config/sensors and config/actuators, what is said of wrong ones, what sets can give."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from benches import hardware
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import CONFIG, DATA

from space_robot_model.hardware.base_actuators import BaseActuatorSettings, MagneticTorquerSettings
from space_robot_model.hardware.sensors import SensorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.plant import Plant
from space_robot_sim.plant.settings import PlantNodeSettings

FILES = {kind: [*(CONFIG / kind).glob("*.yaml")] for kind in ("sensors", "actuators")}
PAPER = Robot.from_yaml(CONFIG / "robots/paper.yaml")
PARTS = ("star_tracker", "gyro", "encoders")
TORQUERS = ("torquer_1", "torquer_2", "torquer_3")
REFUSALS: dict[str, list[tuple[str, str]]] = yaml.safe_load(
    (DATA / "refusals/hardware.yaml").read_text("utf-8")
)


def resolved(**values: Any) -> PlantNodeSettings:
    return PlantNodeSettings.resolve(values)


@pytest.mark.parametrize(
    ("kind", "text", "said"), [(kind, *row) for kind, rows in REFUSALS.items() for row in rows]
)
def test_a_wrong_file_is_refused_in_one_line_with_its_name(
    tmp_path: Path, kind: str, text: str, said: str
) -> None:
    path, (kind, *whose) = tmp_path / "mine.yaml", kind.split()
    path.write_text("plant_node: {ros__parameters: {" + text + "}}")
    with pytest.raises(InputError) as caught:
        Plant(PAPER, resolved(**{kind: str(path)}), 5e-4)
    assert str(caught.value).startswith(f"{'actuators ' if whose else ''}{path}: {said}")
    assert "\n" not in str(caught.value)
    assert caught.value.exit_code == 2


@pytest.mark.parametrize(
    ("kind", "path"), [(kind, path) for kind in FILES for path in FILES[kind]], ids=str
)
def test_a_file_is_about_its_hardware_alone_and_makes_a_plant(kind: str, path: Path) -> None:
    sections = yaml.safe_load(path.read_text("utf-8"))
    allowed = {*PARTS} if kind == "sensors" else set(BaseActuatorSettings.model_fields)
    assert set(sections) <= {"plant_node", "controller_node"}
    assert set(sections["plant_node"]["ros__parameters"]) <= allowed
    assert set(sections.get("controller_node", {}).get("ros__parameters", {})) <= {"allocation"}
    settings = resolved(**{kind: path.stem, "orbit": "iss"})
    plant, by_path = Plant(PAPER, settings, 5e-4), resolved(**{kind: str(path)})
    assert plant.names.actuators == settings.names
    assert (by_path.wheels, by_path.gyro) == (settings.wheels, settings.gyro)
    if kind == "sensors":
        assert plant.measures_truth is (path.stem == "ideal")
    else:
        assert (path.stem == "ideal") is (settings.base_actuation == "ideal")


def test_without_a_choice_everything_is_ideal_and_single_numbers_come_over_a_file() -> None:
    settings = resolved()
    assert settings == resolved(actuators="ideal") == resolved(sensors="ideal")
    for ideal in (BaseActuatorSettings(), SensorSettings()):
        assert all(
            getattr(settings, key) == getattr(ideal, key) for key in type(ideal).model_fields
        )
    more = {"wheels.max_torque": [1.0, 2.0, 3.0, 4.0], "star_tracker.delay": 0.3}
    settings, plain = (resolved(sensors="fine", actuators="wheels", **own) for own in (more, {}))
    assert settings.wheels.values("max_torque").tolist() == [1.0, 2.0, 3.0, 4.0]
    assert settings.wheels.axes == plain.wheels.axes
    assert settings.star_tracker.delay == 0.3
    assert settings.star_tracker.rate == plain.star_tracker.rate


def test_names_are_numbered_wheels_first_and_torquers_last() -> None:
    """A command has its numbers in this order."""
    axis, two = [1.0, 0.0, 0.0], [1.0, 0.0, 0.0] * 2
    thrusters = {"positions": two, "directions": two}
    wheels, torquers = {"axes": axis * 3}, {"axes": axis}
    settings = hardware(wheels=wheels, thrusters=thrusters, magnetic_torquers=torquers)
    names = settings.robot_names(PAPER)
    assert names.wheels == ("wheel_1", "wheel_2", "wheel_3")
    assert (names.thrusters, names.torquers) == (("thruster_1", "thruster_2"), ("torquer_1",))
    assert settings.names == names.actuators == names.wheels + names.thrusters + names.torquers
    assert names.commanded == (*names.axes, *names.actuators)
    assert BaseActuatorSettings().names == ()


def test_axes_of_torquers_are_directions_and_one_dipole_may_stand_for_all() -> None:
    axes = [3.0, 0.0, 4.0, 0.0, -0.1, 0.0]
    same = MagneticTorquerSettings(axes=axes, max_dipole=[30.0])
    np.testing.assert_array_equal(same.unit_axes, [[0.6, 0.0, 0.8], [0.0, -1.0, 0.0]])
    np.testing.assert_array_equal(same.values("max_dipole"), [30.0, 30.0])
    each = MagneticTorquerSettings(axes=axes, max_dipole=[30.0, 20.0])
    np.testing.assert_array_equal(each.values("max_dipole"), [30.0, 20.0])
    assert MagneticTorquerSettings().unit_axes.shape == (0, 3)
    with pytest.raises(ValueError, match="x, y, z of at most 6 vectors were expected"):
        MagneticTorquerSettings(axes=[1.0, 0.0, 0.0] * 7)


@pytest.mark.parametrize(
    "orbit", [{"orbit": "gto"}, {"orbital_elements.height": 420e3, "magnetism.strength": 1e-12}]
)
def test_a_field_may_come_from_a_file_or_from_numbers(orbit: dict[str, Any]) -> None:
    plant = Plant(PAPER, resolved(actuators="wheels_and_torquers", **orbit), 5e-4)
    assert plant.names.torquers == plant.names.commanded[-3:] == TORQUERS
    assert np.linalg.norm(plant.state.magnetic_field) > 0.0


KEYS = [name for kind in (SensorSettings, BaseActuatorSettings) for name, _ in leaves(kind)]
_NUMBERS = st.lists(st.integers(-2, 2) | st.floats(-1e3, 1e3), max_size=12)
_LEAVES = st.none() | st.booleans() | st.integers() | st.floats() | st.text(max_size=5) | _NUMBERS
_VALUES = st.recursive(
    _LEAVES,
    lambda inner: st.lists(inner, max_size=4) | st.dictionaries(st.text(max_size=9), inner),
    max_leaves=8,
)
_SOME = st.dictionaries(
    st.sampled_from([*KEYS, *PARTS, "wheels", "thrusters", "magnetic_torquers"])
    | st.text(max_size=9),
    _VALUES,
    max_size=4,
)


@settings(max_examples=80)
@given(_SOME, st.sampled_from(FILES["actuators"]), st.sampled_from(FILES["sensors"]))
def test_any_file_makes_hardware_or_one_line(
    content: dict[str, Any], actuators: Path, sensors: Path
) -> None:
    """Whatever stands in it, alone or over a good one: what cannot be flown is refused."""
    content.pop("actuators", None)
    own = {"actuators": actuators.stem, "sensors": sensors.stem, "orbit": "iss"}
    said = ""
    try:
        settings = PlantNodeSettings.resolve({**own, **content})
        settings.check(PAPER, actuators.stem)
        Plant(PAPER, settings, 5e-4)
    except InputError as error:
        said = str(error)
    assert "\n" not in said
