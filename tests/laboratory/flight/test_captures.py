"""Flights in orbit, with captures and releases: met, missed, told by bag and analysis."""

from __future__ import annotations

import shutil
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml
from flights import planned, simulated
from paths import CONFIG
from robots import held_place, meeting_target, target_of

from space_robot.analysis import analyze
from space_robot.analysis.figures.single_flight import control_results
from space_robot.analysis.words import remarks
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit import OrbitSettings
from space_robot_sim.environment.target import Target

EVENTS = ["capture@0.1:tumbling_satellite", "release@0.2:0.05", "capture@0.2001:small_satellite"]
PLAN: dict[str, Any] = {"actuators": "wheels", "duration": 0.3}


def flown(bag: Path | None = None, **options: Any) -> FlightLog:
    return simulate(planned(**{**PLAN, **options}), bag)


# Captures by the tool, wherever it is


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, FlightLog]:
    folder = tmp_path_factory.mktemp("captures") / "bag"
    return folder, flown(folder, events=EVENTS)


def test_the_analysis_counts_what_the_targets_bring(bag: tuple[Path, FlightLog]) -> None:
    """Of a bag that is not trusted, too; the momentum after is that before and the targets'."""
    for log in (bag[1], read_flight(bag[0])):
        texts = log.flight["events"]
        assert [text.partition("@")[0] for text in texts] == ["capture", "release", "capture"]
        assert all("_satellite" not in text.partition("{")[0] for text in texts)
        report = analyze(log)
        assert report["metrics"]["momentum_outside.max"] > 1.0
        assert report["metrics"]["momentum_drift.relative"] < 1e-11
        assert report["events"] == EVENTS
        assert f"events: {', '.join(EVENTS)}" in remarks(report)
    lines = control_results(bag[1], "").axes[0].get_lines()
    assert sum(list(line.get_xdata()) in ([0.1, 0.1], [0.2, 0.2]) for line in lines) == 2
    log.flight["scenario"]["events"] = []
    assert analyze(log)["metrics"]["momentum_drift.relative"] > 0.1


def test_a_file_that_a_bag_names_is_opened_only_if_it_is_trusted(
    bag: tuple[Path, FlightLog], tmp_path: Path
) -> None:
    log = read_flight(bag[0])
    log.flight["scenario"]["events"] = [f"capture@0.1:{tmp_path / 'target.yaml'}"]
    report = analyze(log)
    assert "momentum_robot.max" not in report["metrics"]
    assert "the bag refers to a file as its target" in report["unavailable"]["momentum"]


def mission_of(folder: Path, events: list[str]) -> str:
    """The paper's mission with events, in a folder of its own."""
    folder.mkdir()
    content = yaml.safe_load((CONFIG / "missions/paper.yaml").read_text("utf-8"))
    content["mission"]["events"] = events
    (folder / "mission.yaml").write_text(yaml.safe_dump(content), "utf-8")
    shutil.copy(CONFIG / "targets/tumbling_satellite.yaml", folder / "mine.yaml")
    return str(folder / "mission.yaml")


def test_a_mission_has_events_and_files_beside_it(tmp_path: Path) -> None:
    def events(**options: Any) -> Any:
        return planned(**options).description.get("events")

    mission = mission_of(tmp_path / "own", ["capture@0.1:mine.yaml"])
    assert events() is None
    assert events(mission=mission) == events(events=["capture@0.1:tumbling_satellite"])
    assert planned(mission=mission).plant.captures.next_tick(0) == 200
    (text,) = events(mission=mission, events=["capture@1:small_satellite"])
    assert text.startswith('capture@1:{"name": "small_satellite"')
    assert events(mission=mission, parameters={"plant": {"events": [""]}}) is None
    lost = mission_of(tmp_path / "lost", ["capture@0.1:yours.yaml"])
    with pytest.raises(InputError, match=r"event 'capture@0.1:yours.yaml': yours.yaml: "):
        events(mission=lost)


# Targets on orbits of their own, which are met or missed

ORBIT = OrbitSettings.model_validate(
    {
        "orbital_elements": {"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 30.0},
        "gravity": {"gradient": False},
    }
)
"""Nothing turns the robot from outside."""
CAPTURE = 200
"""Tick."""


@pytest.fixture(scope="module")
def without() -> FlightLog:
    return flown(orbit=ORBIT)


@pytest.fixture(scope="module")
def target(without: FlightLog) -> Target:
    """One that the tool meets on the mission's way."""
    robot = planned(**PLAN, orbit=ORBIT).plant.robot
    place, _ = held_place(robot, without.state(CAPTURE), target_of())
    motion = {"velocity": [0.2, -0.1, 0.3], "angular_velocity": [0.2, -0.1, 0.15]}
    return meeting_target(ORBIT, 0.1, place, **motion)


def flown_events(target: Target, distance: float = 0.0) -> list[str]:
    """Capture of a target that passes the given one at a distance, m, and its release."""
    start = np.array(target.motion.position) + distance * np.array([2.0, -1.0, 2.0]) / 3.0
    motion = target.motion.model_copy(update={"position": start.tolist()})
    return [
        f"capture@0.1:{target.model_copy(update={'motion': motion}).inline}",
        "release@0.2:0.05",
    ]


def missed_in(report: dict[str, Any]) -> dict[str, float]:
    return {name: x for name, x in report["metrics"].items() if name.startswith("missed.")}


def test_what_is_met_is_counted_by_the_analysis(
    without: FlightLog, target: Target, tmp_path: Path
) -> None:
    """Nothing else is left of the momentum."""
    log = flown(tmp_path / "bag", orbit=ORBIT, events=flown_events(target))
    assert np.abs(log.omega_base[CAPTURE] - without.omega_base[CAPTURE]).max() > 1e-3
    recorded = read_flight(tmp_path / "bag")
    for flight in (log, recorded):
        report = analyze(flight)
        assert not missed_in(report)
        assert not [text for text in remarks(report) if "did not happen" in text]
        assert report["metrics"]["momentum_outside.max"] > 1.0
        assert report["metrics"]["momentum_drift.relative"] < 1e-11
    faster = target.motion.model_copy(update={"velocity": [0.2, -0.1, 0.2]})
    recorded.flight["scenario"]["events"] = flown_events(
        target.model_copy(update={"motion": faster})
    )
    assert analyze(recorded)["metrics"]["momentum_drift.relative"] > 1e-3


def test_what_is_missed_leaves_every_bit_and_is_reported(
    without: FlightLog, target: Target, tmp_path: Path
) -> None:
    log = flown(tmp_path / "bag", orbit=ORBIT, events=flown_events(target, 0.25))
    for name, column in without.columns.items():
        assert log.columns[name].tobytes() == column.tobytes(), name
    for flight in (log, read_flight(tmp_path / "bag")):
        report = analyze(flight)
        assert missed_in(report) == {"missed.capture@0.1:drifter": pytest.approx(0.25, rel=1e-6)}
        assert (
            "capture@0.1:drifter did not happen: the target was 0.25 m from where the tool holds it"
        ) in remarks(analyze(flight, in_brief=True))
    plain = analyze(without)
    assert report["metrics"] == {**plain["metrics"], **missed_in(report)}
    assert report["sizing"] == plain["sizing"]
    short = flown(orbit=ORBIT, events=flown_events(target, 0.25), duration=0.05)
    assert not missed_in(analyze(short))


@pytest.mark.parametrize(("time", "missed"), [("15", False), ("12", True)])
def test_the_shipped_target_is_met_by_the_papers_mission(time: str, missed: bool) -> None:
    """As the manual says; three seconds earlier the tool is elsewhere."""
    event = f"capture@{time}:neighbouring_satellite"
    report = analyze(simulated(orbit="iss", events=[event], duration=float(time) + 0.1))
    assert report["events"] == [event]
    assert list(missed_in(report)) == [f"missed.{event}"] * missed
