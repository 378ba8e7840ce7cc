"""Configuration by name, layers and overrides, gain sets, and what is said of bad ones."""

from __future__ import annotations

from decimal import Decimal
from pathlib import Path

import numpy as np
import pytest
import yaml

from space_robot_control.controller.gains import build_law, read_gains
from space_robot_control.controller.settings import ControllerNodeSettings, gain_files
from space_robot_control.guidance.mission import MissionNodeSettings
from space_robot_control.laws import laws
from space_robot_msgs_py.bag.recorder import RecorderNodeSettings
from space_robot_msgs_py.config.files import (
    GIVEN,
    flatten,
    is_named,
    merge,
    named_file,
    named_layers,
    nest,
    node_parameters,
)
from space_robot_msgs_py.config.installation import config_directory
from space_robot_msgs_py.config.settings import leaves
from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.settings import PlantNodeSettings

SCHEMAS = (PlantNodeSettings, ControllerNodeSettings, MissionNodeSettings, RecorderNodeSettings)
OTHERS = ("campaigns", "qos", "requirements", "robots", "targets", "telemetry")
NO_PARAMETERS = ("default_sets.yaml", "ideal.yaml")
"""Files that name sets, or have nothing to say."""


def test_every_setting_has_a_description() -> None:
    for schema in SCHEMAS:
        for name, field in leaves(schema):
            assert field.description, f"{schema.node}: {name}"


def test_every_shipped_parameter_file_is_one() -> None:
    for path in config_directory().rglob("*.yaml"):
        if (
            path.parent.name in OTHERS
            or path.name in NO_PARAMETERS
            or "mission" in yaml.safe_load(path.read_text())  # a document
        ):
            continue
        for node in yaml.safe_load(path.read_text()):
            assert node_parameters(path, node.strip("/").removesuffix("_node"))


def test_a_file_may_speak_to_a_node_of_any_namespace(tmp_path: Path) -> None:
    path = tmp_path / "case.yaml"
    for name in ("plant_node", "/plant_node", "/**/plant_node", "/**"):
        path.write_text(f"{name}: {{ros__parameters: {{realtime: true}}}}")
        assert node_parameters(path, "plant") == {"realtime": True}
    path.write_text("/**/mission_node: {ros__parameters: {realtime: true}}")
    assert node_parameters(path, "plant") == {}


def test_a_node_waits_for_listeners_to_what_it_sends_alone() -> None:
    assert PlantNodeSettings.resolve({"wait_for": ["a:/clock", "b", ""]}).wait_for[0] == "a:/clock"
    for schema, entry, sent in (
        (PlantNodeSettings, "recorder_node:/command", "joint_states, wheels/state, "),
        (ControllerNodeSettings, "plant_node:", "command, controller/telemetry, "),
    ):
        with pytest.raises(InputError) as error:
            schema.resolve({"wait_for": ["recorder_node", entry]})
        said = f"parameters: wait_for: {entry!r}: choose a topic it sends, {sent}"
        assert str(error.value).startswith(f"{schema.node} {said}")


def test_layers_and_overrides() -> None:
    settings = PlantNodeSettings.resolve({"case": "4-1", "friction.viscous": 0.5})
    assert settings.disturbance.scale == 2.0  # from the case
    assert settings.payload.mass == 15.0
    assert settings.friction.viscous == 0.5  # from the override
    assert settings.friction.coulomb == 0.02
    assert settings.initial_joints_deg[1] == 120.0  # from the mission


@pytest.mark.parametrize(("robot", "axes"), [("paper", 9), ("seven_joint", 10)])
def test_every_law_has_tuned_and_default_gains(robot: str, axes: int) -> None:
    for gain_set in ("tuned", "default"):
        files = gain_files(robot, gain_set)
        assert set(files) == set(laws())
        for name, path in files.items():
            read_gains(path, laws()[name], axes)


def test_names_of_files_and_paths(tmp_path: Path) -> None:
    for suffix in ("yaml", "yml"):
        path = tmp_path / f"mine.{suffix}"
        path.write_text("")
        assert named_file("cases", str(path)) == path
    assert named_layers("cases", "1") == [config_directory() / "cases/1.yaml"]
    assert named_layers("cases", GIVEN) == []
    assert is_named("cases", "4-1")
    for name in ("4", "../cases/1", "1.yaml", "a" * 300):
        assert not is_named("cases", name), name


@pytest.mark.parametrize("period", [1e-5, 0.1, 0.00037])
def test_a_period_is_a_whole_number_of_nanoseconds(period: float) -> None:
    settings = PlantNodeSettings.resolve({"period": period})
    assert settings.timebase.period_ns == int(Decimal(str(period)) * 10**9)


@pytest.mark.parametrize(
    ("name", "value"),
    [("period", 9.9e-6), ("period", 0.1001), ("fifo_priority", -1), ("fifo_priority", 99)],
)
def test_settings_of_every_node_have_limits(name: str, value: float) -> None:
    for schema in SCHEMAS:
        with pytest.raises(InputError, match=f"^{schema.node} parameters: {name}: Input should be"):
            schema.resolve({name: value})
    assert PlantNodeSettings.resolve({"fifo_priority": 98}).fifo_priority == 98


@pytest.mark.parametrize(
    ("flat", "name"),
    [
        ({"a": 1, "a.b": 2}, "a"),
        ({"a.b": 1, "a": 2}, "a"),
        ({"a.b.c": 1, "a.b": 2}, "a.b"),
        ({"a": {"b": 1}, "a.b": {"c": 2}}, "a.b"),
        ({"a.\x11\n": 1, "a": {"\x11\n": {"c": 2}}}, "a.??"),
    ],
)
def test_a_value_that_is_a_group_too_is_refused(flat: dict[str, object], name: str) -> None:
    with pytest.raises(InputError) as caught:
        nest(flat)
    assert str(caught.value) == f"{name}: given as a value, and as a group of values"


def test_what_lies_below_is_not_changed_by_what_is_put_over_it() -> None:
    below = {"a": {"b": 1}, "c": 2}
    assert merge(below, {"a": {"d": 3}, "c": {"e": 4}}) == {"a": {"b": 1, "d": 3}, "c": {"e": 4}}
    assert merge(below, {"a": 5}) == {"a": 5, "c": 2}
    assert below == {"a": {"b": 1}, "c": 2}
    assert dict(flatten({"a": {}, "b": {"c": {"d": 1}}})) == {"a": {}, "b.c.d": 1}
    assert nest({"a.b": 1, "a.c": {"d.e": 2}}) == {"a": {"b": 1, "c": {"d": {"e": 2}}}}


def test_printed_gains_are_table_iv() -> None:
    settings = ControllerNodeSettings.resolve({"gains": "printed"})
    stc = build_law("tde_stc", settings, 9).gains
    np.testing.assert_array_equal(stc.k_1, [0.02, 0.02, 0.02, 0.2, 0.2, 0.2, 0.4, 0.2, 0.2])
    np.testing.assert_array_equal(stc.k_2, np.r_[[8e-5] * 3, [3e-3] * 3, 4e-3, 2e-3, 2e-3])
    ctc = build_law("ctc", settings, 9).gains
    np.testing.assert_array_equal(ctc.k_p, np.r_[7.5e6, [5e6] * 5, 5e4, 5e4, 8e3])
    np.testing.assert_array_equal(ctc.k_d, np.r_[[5e4] * 6, 2e3, 8e3, 1e2])
