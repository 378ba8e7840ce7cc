"""Friction, the disturbance (61), a user's own, the payload: numbers of the paper and NumPy's."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from hypothesis import given, settings
from hypothesis import strategies as st
from paths import DATA
from pydantic import ValidationError
from strategies import KINDS, random_robot, random_tree

from space_robot_model.dynamics.model import MOST_JOINTS
from space_robot_model.elementary.matrices import Array
from space_robot_model.robot import Robot
from space_robot_msgs_py.compiled.records import assign
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import MOST_WHEELS, RobotNames
from space_robot_sim.component import ComponentFaults, Installation
from space_robot_sim.environment.disturbance import (
    Disturbance,
    DisturbanceSettings,
    LoadSchedule,
    PrescribedLoads,
    add_loads,
    begin_loads,
    disturbance_torque,
)
from space_robot_sim.environment.disturbance_table import DisturbanceTable, table_text
from space_robot_sim.environment.environment import (
    Environment,
    EnvironmentSettings,
    PayloadSettings,
    with_payload,
)
from space_robot_sim.environment.friction import (
    Friction,
    FrictionSettings,
    coefficients,
    friction_torque,
)
from space_robot_sim.faults.grammar import parse_faults
from space_robot_sim.faults.schedule import Schedule
from space_robot_sim.plant.settings import PLANT_KINDS

REFUSALS = yaml.safe_load((DATA / "refusals/environment.yaml").read_text("utf-8"))
TABLES = [tuple(row) for row in REFUSALS["tables"]]
FOUR = random_robot(np.random.default_rng(4), 4)


def disturbance(n: int, scale: float, time: float) -> Array:
    memory = np.full(n + 12, np.nan)
    sines = Disturbance.build(DisturbanceSettings(scale=scale), Installation(n))
    disturbance_torque(sines, time, memory[: n + 3])
    assert np.isnan(memory[n + 3 :]).all(), "behind a short robot's array"
    return memory[: n + 3]


def test_friction_of_the_largest_robot_with_the_most_wheels_is_each_ones_own() -> None:
    robot = random_robot(np.random.default_rng(1), MOST_JOINTS)
    joints = Friction.build(
        FrictionSettings(coulomb=0.3, viscous=0.7), Installation(robot.n, robot=robot)
    )
    wheels, out = np.arange(1.0, MOST_WHEELS + 1.0), np.full(MOST_JOINTS + MOST_WHEELS, np.nan)
    joints.coulomb[MOST_JOINTS : out.size] = 10.0 * wheels
    joints.viscous[MOST_JOINTS : out.size] = 100.0 * wheels
    assign(joints, count=out.size)
    friction_torque(joints, np.full(out.size, 2.0), np.ones(out.size), out)
    np.testing.assert_array_equal(out[:MOST_JOINTS], 0.3 + 0.7 * 2.0)
    np.testing.assert_array_equal(out[MOST_JOINTS:], 10.0 * wheels + 100.0 * wheels * 2.0)


def equation_61(n: int, k: float, t: float) -> Array:
    """As printed, joints beyond the third like the fourth."""
    pi = np.pi
    base = 0.010 * k * (np.sin(pi * t) + np.sin(1.5 * pi * t))
    inner = 0.005 * k * (np.sin(0.5 * pi * t) + np.sin(pi * t))
    outer = 0.002 * k * np.sin(0.5 * pi * t)
    return np.array([*[base] * 3, *[inner] * 3, *[outer] * 6][: n + 3])


@settings(max_examples=40)
@given(st.integers(1, 9), st.sampled_from([0.0, 1.0, 2.0, 3.0]), st.floats(0.0, 30.0, width=32))
def test_disturbance_is_equation_61(n: int, scale: float, time: float) -> None:
    """At any time, for all cases' amplitudes and any number of joints."""
    np.testing.assert_allclose(
        disturbance(n, scale, time), equation_61(n, scale, time), rtol=1e-12, atol=1e-15
    )


def test_a_robots_own_friction_comes_before_the_settings() -> None:
    """And the settings' before none, but for passive joints, which have their own alone."""
    spring = {"stiffness": 9.0, "damping": 0.1}
    body = {"mass": 2.0, "inertia": [0.1, 0.1, 0.1, 0.0, 0.0, 0.0], "com": [0.1, 0.0, 0.0]}
    links = [
        {"name": "panel", **body, "passive": spring},
        {"name": "own", **body, "friction": {"coulomb": 0.3, "viscous": 0.0}},
        {"name": "usual", **body},
        {
            "name": "rubbing",
            **body,
            "passive": spring,
            "friction": {"coulomb": 0.0, "viscous": 2.0},
        },
    ]
    base = {key: body[key] for key in ("mass", "inertia")}
    robot = Robot.from_dict({"robot": {"name": "four", "base": base, "links": links}})
    assert robot.all_joint_names == ("own", "usual", "panel", "rubbing")
    found = coefficients(robot, FrictionSettings(coulomb=0.02, viscous=0.2))
    assert found.tolist() == [[0.3, 0.0], [0.02, 0.2], [0.0, 0.0], [0.0, 2.0]]
    friction = Friction.build(
        FrictionSettings(coulomb=0.02, viscous=0.2), Installation(robot.n, robot=robot)
    )
    assert friction.viscous[:4].tolist() == [found[j, 1] for j in robot.order]


@settings(max_examples=25)
@given(st.integers(0, 2**32 - 1), st.lists(st.sampled_from(KINDS), min_size=2, max_size=8))
def test_a_stuck_joint_is_the_one_named(seed: int, kinds: list[str]) -> None:
    """Of a tree, in which passive joints and other branches come before it; and it comes free."""
    tree = random_tree(np.random.default_rng(seed), ["revolute", *kinds])
    robot = Robot.from_tree(tree)
    names = RobotNames(robot.joint_names, passive=robot.passive_names)
    environment = Environment.build(EnvironmentSettings(), Installation(robot.n, robot=robot))
    friction = environment.friction
    sound = friction.coulomb.copy()
    rows = {robot.all_joint_names[joint]: row for row, joint in enumerate(robot.order)}
    for name in robot.joint_names:
        texts = [f"stuck_joint@1-2:{name}=9"]
        stuck = ComponentFaults(
            Schedule(parse_faults(texts, PLANT_KINDS), 0, 0.5, names), Environment
        )
        stuck.apply(2, environment)
        expected = sound.copy()
        expected[rows[name]] = 9.0
        np.testing.assert_array_equal(friction.coulomb, expected)
        stuck.apply(4, environment)
        np.testing.assert_array_equal(friction.coulomb, sound)


def test_friction_of_a_joint_that_breaks_away_opposes_what_comes() -> None:
    """Not yet turning, it has the whole Coulomb torque; one that stands has none of its own."""
    joints, out = (
        Friction.build(FrictionSettings(coulomb=5.0), Installation(FOUR.n, robot=FOUR)),
        np.empty(4),
    )
    friction_torque(joints, np.zeros(4), np.array([0.0, 1.0, -1.0, 0.0]), out)
    np.testing.assert_array_equal(out, [0.0, 5.0, -5.0, 0.0])


def test_payload_replaces_mass_and_inertia_of_the_last_link(paper_robot: Robot) -> None:
    """Case 3's: 10 kg; the CoM vector and every other body unchanged."""
    payload = PayloadSettings(mass=10.0, inertia=[1.2, 0.6, 1.0, 0.0, 0.0, 0.0])
    loaded = with_payload(paper_robot, payload)
    assert loaded.mass[-1] == 10.0
    np.testing.assert_array_equal(loaded.inertia[-1], np.diag([1.2, 0.6, 1.0]))
    np.testing.assert_array_equal(loaded.com, paper_robot.com)
    np.testing.assert_array_equal(loaded.mass[:-1], paper_robot.mass[:-1])
    np.testing.assert_array_equal(loaded.inertia[:-1], paper_robot.inertia[:-1])
    assert loaded.model.mass[6] == 10.0, "the compiled algorithms must see the payload"
    assert with_payload(paper_robot, PayloadSettings()) is paper_robot


@pytest.mark.parametrize(("section", "values"), REFUSALS["settings"])
def test_settings_refuse_what_is_not_physical(section: str, values: dict[str, Any]) -> None:
    with pytest.raises(ValidationError, match=next(iter(values))):
        EnvironmentSettings.model_validate({section: values})


PERIOD = 0.0005
JOINTS = ("shoulder", "elbow")


def schedule(columns: dict[str, Any], scale: float = 1.0) -> LoadSchedule:
    table = DisturbanceTable.of(columns, "here")
    return LoadSchedule.of(DisturbanceSettings(table=table.text, table_scale=scale), JOINTS, PERIOD)


def test_text_and_file_have_the_same_numbers(tmp_path: Path) -> None:
    columns = {"time": [0.0, 0.1, 1 / 3], "base_force_x": [1e-300, -0.1, 7.0]}
    rows = zip(*columns.values(), strict=True)
    lines = [",".join(columns), *(",".join(map(repr, row)) for row in rows)]
    (tmp_path / "wind.csv").write_text("\n".join(lines))
    table = DisturbanceTable.of(columns, "here")
    assert table_text("wind.csv", tmp_path) == table.text == table_text(table.text)
    assert DisturbanceTable.parse(table.text) == table
    assert table.label == "base_force_x from 0 to 0.333333 s"
    for name in ("wind", "wind.txt", "no_such.csv"):
        with pytest.raises(InputError, match=name):
            table_text(name)
    parquet = pytest.importorskip("pyarrow.parquet")
    import pyarrow

    parquet.write_table(pyarrow.table(columns), tmp_path / "wind.parquet")
    assert table_text("wind.parquet", tmp_path) == table.text


MANY = {"time": list(range(25_001)), "elbow": [0.0] * 25_001}
TOO_MANY = "25001 rows of 2 columns are 50002 values, at most 50000 are allowed"


@pytest.mark.parametrize(("columns", "said"), [*TABLES, (MANY, TOO_MANY)])
def test_what_is_wrong_is_named(columns: dict[str, Any], said: str) -> None:
    with pytest.raises(InputError) as refused:
        schedule(columns)
    assert said in str(refused.value)
    assert "\n" not in str(refused.value)


rows = st.lists(st.integers(0, 400), min_size=2, max_size=90, unique=True).map(sorted)


@given(rows, st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_rows_on_ticks_fly_exactly(ticks: list[int], seed: int) -> None:
    """Linear between rows, zero before and after; the impulse is the table's integral."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(len(ticks), 2))
    time = np.array(ticks) * PERIOD
    columns = {"time": time.tolist(), "base_torque_y": values[:, 0], "elbow": values[:, 1]}
    own = schedule({k: np.asarray(v).tolist() for k, v in columns.items()}, scale=3.0)
    begin, end = own.over(np.arange(450))
    inside = np.arange(ticks[0], ticks[-1])
    for place, of_rows in ((4, values[:, 0]), (7, values[:, 1])):
        expected = 3.0 * np.interp(inside, ticks, of_rows)
        np.testing.assert_allclose(begin[inside, place], expected, rtol=0.0, atol=1e-12)
        outside = np.delete(np.arange(450), inside)
        assert not begin[outside, place].any()
        assert not end[outside, place].any()
        impulse = 0.5 * PERIOD * np.sum(begin[:, place] + end[:, place])
        assert impulse == pytest.approx(3.0 * np.trapezoid(of_rows, time), abs=1e-12)
    assert not np.delete(begin, (4, 7), axis=1).any()


@given(
    st.lists(st.floats(0.0, 0.25, width=32), min_size=2, max_size=200, unique=True).map(sorted),
    st.integers(0, 2**32 - 1),
)
@settings(max_examples=20, deadline=None)
def test_the_record_has_what_the_schedule_says(times: list[float], seed: int) -> None:
    """Tick by tick, begun anywhere, through all parts that the record holds at a time."""
    rng = np.random.default_rng(seed)
    columns = {"time": times, "base_force_z": rng.normal(size=len(times)).tolist()}
    try:
        own = schedule(columns)
    except InputError:  # all between two ticks
        return
    ticks = np.arange(int(rng.integers(0, 300)), 520)
    begin, end = own.over(ticks)
    record, given = PrescribedLoads.allocate(len(JOINTS)), rng.normal(size=6)
    due = own.apply(int(ticks[0]), record)
    for tick, first, last in zip(ticks.tolist(), begin, end, strict=True):
        if tick >= due:
            assert tick == due
            due = own.apply(tick, record)
        begin_loads(record, tick, PERIOD, given)
        for time, expected in ((tick * PERIOD, first), ((tick + 1) * PERIOD, last)):
            wrench, disturbance = np.full(6, np.nan), np.ones(5)
            add_loads(record, time, wrench, disturbance)
            np.testing.assert_allclose(wrench, given + expected[:6], rtol=0.0, atol=1e-9)
            np.testing.assert_allclose(disturbance[3:], 1.0 - expected[6:], rtol=0.0, atol=1e-9)
            assert (disturbance[:3] == 1.0).all()
