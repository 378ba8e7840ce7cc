"""Captures and releases: by option or mission, told by the bag, seen by the analysis."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from paths import CONFIG

from space_robot import Scenario
from space_robot.analysis import analyze
from space_robot.analysis.figures.single_flight import control_results
from space_robot.analysis.words import remarks
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.scenario.comparison import recorded_scenario
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Reference

EVENTS = ["capture@0.1:tumbling_satellite", "release@0.2:0.05", "capture@0.2001:small_satellite"]
PLAN: dict[str, Any] = {"actuators": "wheels", "events": EVENTS, "duration": 0.3}
COLUMNS = (
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_velocities",
    "wheel_velocities",
    "applied_torque",
    "commanded_torque",
)


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, FlightLog]:
    folder = tmp_path_factory.mktemp("captures") / "bag"
    return folder, simulate(Flight(resolve(FlightPlan(**PLAN))), folder)


def mission_of(folder: Path, events: list[str]) -> Path:
    """The paper's mission with events, in a folder of its own."""
    folder.mkdir()
    content = yaml.safe_load((CONFIG / "missions/paper.yaml").read_text("utf-8"))
    content["plant_node"]["ros__parameters"]["events"] = events
    path = folder / "mission.yaml"
    path.write_text(yaml.safe_dump(content), "utf-8")
    shutil.copy(CONFIG / "targets/tumbling_satellite.yaml", folder / "mine.yaml")
    return path


def test_a_bag_tells_the_targets_numbers_and_flies_again(bag: tuple[Path, FlightLog]) -> None:
    """To the same bits, and without the targets' files."""
    described = read_flight(bag[0]).flight
    assert [text.partition("@")[0] for text in described["events"]] == [
        "capture",
        "release",
        "capture",
    ]
    assert all("_satellite" not in text.partition("{")[0] for text in described["events"])
    again = Flight(resolve(FlightPlan.model_validate(recorded_scenario(bag[0]))))
    assert again.description["events"] == described["events"]
    log = simulate(again)
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(log, column), getattr(bag[1], column), column)


def test_compiled_stretches_fly_as_single_ticks_do(bag: tuple[Path, FlightLog]) -> None:
    flight, log = Flight(resolve(FlightPlan(**PLAN))), bag[1]
    assert log.commanded_torque is not None
    reference, chunk = Reference.at_rest(flight.robot.n), flight.mission.chunk(0, flight.ticks)
    joints, base = Reference.parts(reference)
    for tick in range(flight.ticks):
        joints[0], base[0] = chunk.joints[tick], chunk.base[tick]
        np.testing.assert_array_equal(flight.plant.state.omega_base, log.omega_base[tick])
        command = flight.controller.update(flight.plant.state, reference)
        np.testing.assert_array_equal(command.torque[:9], log.commanded_torque[tick])
        flight.plant.step(command)


def test_a_bench_goes_back_behind_a_capture(bag: tuple[Path, FlightLog]) -> None:
    """The robot that flies on is the bare one again."""
    bench, bare = Scenario(**PLAN).bench(), bag[1].omega_base
    while bench.tick < 150:
        bench.step()
    snapshot = bench.save()
    for _ in range(2):
        bench.restore(snapshot)
        while bench.tick < 450:
            bench.step()
            np.testing.assert_array_equal(bench.state.omega_base, bare[bench.tick])


def test_the_analysis_counts_what_the_targets_bring(bag: tuple[Path, FlightLog]) -> None:
    """Of a bag that is not trusted, too; the momentum after is that before and the targets'."""
    for log in (bag[1], read_flight(bag[0])):
        report = analyze(log)
        budget = report["momentum"]
        assert budget["peak_n_m_s"]["outside"] > 1.0
        assert budget["drift"]["relative"] < 1e-11
        assert report["events"] == EVENTS
        assert f"events: {', '.join(EVENTS)}" in remarks(report)
    upright = [
        line
        for line in control_results(bag[1], "").axes[0].get_lines()
        if list(line.get_xdata()) in ([0.1, 0.1], [0.2, 0.2])
    ]
    assert len(upright) == 2
    del log.flight["events"]
    assert analyze(log)["momentum"]["drift"]["relative"] > 0.1


def test_a_file_that_a_bag_names_is_opened_only_if_it_is_trusted(
    bag: tuple[Path, FlightLog], tmp_path: Path
) -> None:
    log = read_flight(bag[0])
    log.flight["events"] = [f"capture@0.1:{tmp_path / 'target.yaml'}"]
    report = analyze(log)
    assert report["momentum"] is None
    assert "the bag refers to a file as its target" in report["unavailable"]["momentum"]


def test_a_mission_has_events_and_files_beside_it(tmp_path: Path) -> None:
    mission = mission_of(tmp_path / "own", ["capture@0.1:mine.yaml"])
    flight = Flight(resolve(FlightPlan(mission=str(mission))))
    expected = Flight(resolve(FlightPlan(events=["capture@0.1:tumbling_satellite"])))
    assert flight.description["events"] == expected.description["events"]
    assert flight.plant.captures.next_tick(0) == 200
    other = Flight(resolve(FlightPlan(mission=str(mission), events=["capture@1:small_satellite"])))
    (text,) = other.description["events"]
    assert text.startswith('capture@1:{"name": "small_satellite"')
    without = Flight(
        resolve(FlightPlan(mission=str(mission), parameters={"plant": {"events": [""]}}))
    )
    assert "events" not in without.description
    lost = mission_of(tmp_path / "lost", ["capture@0.1:yours.yaml"])
    with pytest.raises(InputError, match=r"event 'capture@0.1:yours.yaml': yours.yaml: "):
        Flight(resolve(FlightPlan(mission=str(lost))))


def test_no_event_changes_nothing() -> None:
    assert "events" not in Flight(resolve(FlightPlan())).description
