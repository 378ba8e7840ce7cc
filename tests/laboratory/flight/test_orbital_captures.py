"""Flights whose tool meets a target on a neighbouring orbit, or misses it: bags, reports, lanes."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from command import Run
from meeting_targets import held_place, meeting_target, target_of
from numpy.typing import NDArray

import space_robot as sr
from space_robot.analysis import analyze
from space_robot.analysis.described import captures_of
from space_robot.analysis.missed_captures import MissedCaptures
from space_robot.analysis.words import remarks
from space_robot.flight.batch.sharing import batches
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot.scenario.comparison import recorded_scenario
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_sim.environment.orbit_settings import OrbitSettings
from space_robot_sim.environment.target import Target

Array = NDArray[np.float64]

ORBIT = OrbitSettings.model_validate(
    {
        "orbital_elements": {"height": 420e3, "inclination_deg": 51.6, "anomaly_deg": 30.0},
        "gravity": {"gradient": False},
    }
)
"""Nothing turns the robot from outside."""
CAPTURE_S, RELEASE_S, DURATION_S = 0.1, 0.2, 0.3
CAPTURE = 200
"""Tick."""
TUMBLING = {"velocity": [0.2, -0.1, 0.3], "angular_velocity": [0.2, -0.1, 0.15]}
MISS = 0.25
"""m, of what is meant to be missed."""


def plan_of(events: list[str], **options: Any) -> FlightPlan:
    usual = {"orbit": ORBIT, "actuators": "wheels", "duration": DURATION_S, "events": events}
    return FlightPlan.model_validate({**usual, **options})


def flown(events: list[str], bag: Path | None = None, **options: Any) -> FlightLog:
    return simulate(Flight(resolve(plan_of(events, **options))), bag)


@pytest.fixture(scope="module")
def without() -> FlightLog:
    return flown([])


@pytest.fixture(scope="module")
def target(without: FlightLog) -> Target:
    """One that the tool meets on the mission's way."""
    robot = Flight(resolve(plan_of([]))).plant.robot
    place, _ = held_place(robot, without.state(CAPTURE), target_of())
    return meeting_target(ORBIT, CAPTURE_S, place, **TUMBLING)


def beside(target: Target, distance: float) -> Target:
    """Return a target that passes the one that is met at a distance, m."""
    start = np.array(target.motion.position) + distance * np.array([2.0, -1.0, 2.0]) / 3.0
    motion = target.motion.model_copy(update={"position": start.tolist()})
    return target.model_copy(update={"motion": motion})


def events_of(target: Target, release: bool = True) -> list[str]:
    capture = f"capture@{CAPTURE_S}:{target.inline}"
    return [capture, f"release@{RELEASE_S}:0.05"] if release else [capture]


def assert_same_bits(found: FlightLog, expected: FlightLog, first: int = 0) -> None:
    """All columns of the states and commands; a bag has telemetry of some ticks only."""
    for name, column in expected.columns.items():
        if name == "telemetry":
            continue
        assert found.columns[name][first:].tobytes() == column[first:].tobytes(), name


def test_what_is_met_changes_the_flight_from_its_tick_on(
    without: FlightLog, target: Target
) -> None:
    log = flown(events_of(target))
    assert_same_bits(log.rows(0, CAPTURE), without.rows(0, CAPTURE))
    assert np.abs(log.omega_base[CAPTURE] - without.omega_base[CAPTURE]).max() > 1e-3
    np.testing.assert_array_equal(log.base_position[CAPTURE], without.base_position[CAPTURE])
    report = analyze(log)
    assert report["missed_captures"] == {}
    assert not [text for text in remarks(report) if "did not happen" in text]


def test_what_is_missed_leaves_every_bit_and_is_reported(
    without: FlightLog, target: Target, tmp_path: Path
) -> None:
    log = flown(events_of(beside(target, MISS)), tmp_path / "bag")
    assert_same_bits(log, without)
    recorded = read_flight(tmp_path / "bag")
    assert not recorded.trusted
    for flight in (log, recorded):
        report = analyze(flight)
        assert report["missed_captures"] == {"capture@0.1:drifter": pytest.approx(MISS, rel=1e-6)}
        assert (
            "capture@0.1:drifter did not happen: the target was 0.25 m from where the tool holds it"
        ) in remarks(report)
        assert report["momentum"]["peak_n_m_s"]["outside"] == 0.0
        assert report["momentum"]["drift"]["relative"] < 1e-11
    plain = analyze(without)
    assert plain["missed_captures"] is None
    same = ("rms", "maxima", "momentum", "pointing", "tool", "sizing")
    assert [report[key] for key in same] == [plain[key] for key in same]


@pytest.mark.parametrize("sensors", ["ideal", "fine"])
def test_a_bag_tells_the_capture_and_flies_again(
    target: Target, tmp_path: Path, sensors: str
) -> None:
    """Its analysis counts what the target brought: nothing else is left of the momentum."""
    bag = tmp_path / "bag"
    log = flown(events_of(target), bag, sensors=sensors)
    recorded = read_flight(bag)
    assert_same_bits(recorded, log)
    again = Flight(resolve(FlightPlan.model_validate(recorded_scenario(bag))))
    assert again.description["events"] == recorded.flight["events"]
    assert_same_bits(simulate(again), log)
    for flight in (log, recorded):
        budget = analyze(flight)["momentum"]
        assert budget["peak_n_m_s"]["outside"] > 1.0
        assert budget["drift"]["relative"] < 1e-11
    assert analyze(recorded) == analyze(log)
    json.dumps(analyze(recorded), allow_nan=False)
    # with the velocity of another target it would not be so
    faster = target.motion.model_copy(update={"velocity": [0.2, -0.1, 0.2]})
    other = target.model_copy(update={"motion": faster})
    recorded.flight["events"] = events_of(other)
    wrong = analyze(recorded)
    assert wrong["missed_captures"] == {}
    assert wrong["momentum"]["drift"]["relative"] > 1e-3


@pytest.mark.parametrize("cuts", [(CAPTURE,), (CAPTURE + 1,), (1, 150, 300, 599)])
def test_misses_do_not_depend_on_the_blocks(
    without: FlightLog, target: Target, cuts: tuple[int, ...]
) -> None:
    log = flown(events_of(beside(target, MISS)))
    metric = MissedCaptures(captures_of(log))
    for start, stop in zip((0, *cuts), (*cuts, log.ticks), strict=True):
        metric.add(log.rows(start, stop), np.empty(0))
    assert metric.result() == analyze(log)["missed_captures"]
    assert len(metric.result()) == 1


def test_a_capture_behind_the_end_of_a_log_is_not_missed(target: Target) -> None:
    log = flown(events_of(beside(target, MISS)), duration=0.05)
    assert analyze(log)["missed_captures"] == {}


def test_eight_flights_of_which_some_miss_have_the_bits_of_each_alone(target: Target) -> None:
    """In lanes a capture happens in some flights and not in others, at one tick and at another."""
    distances = (0.0, MISS, 0.0, MISS, 0.04, 0.06, 1.0, 0.01)

    def scenarios() -> list[sr.Scenario]:
        return [
            sr.Scenario(
                orbit=ORBIT,
                actuators="wheels",
                duration=DURATION_S,
                events=events_of(beside(target, distance), release=number % 3 != 0),
                seed=number,
                faults=[f"noise_gyro@0:{1e-7 * (number + 1):g}"],
            )
            for number, distance in enumerate(distances)
        ]

    groups = [[n for n, _ in g] for g in batches(enumerate(s.check() for s in scenarios()))]
    assert groups == [list(range(8))]
    together = sr.fly_many(scenarios())
    for distance, flight, scenario in zip(distances, together, scenarios(), strict=True):
        alone = scenario.fly()
        assert flight.outcome == alone.outcome == "complete"
        assert_same_bits(flight.log, alone.log)
        assert flight.report()["missed_captures"] == alone.report()["missed_captures"]
        assert bool(alone.report()["missed_captures"]) is (distance > 0.05)


def test_a_bench_goes_back_behind_a_capture_in_orbit(target: Target) -> None:
    for distance in (0.0, MISS):
        scenario = sr.Scenario(
            orbit=ORBIT,
            actuators="wheels",
            duration=DURATION_S,
            events=events_of(beside(target, distance)),
        )
        log, bench = scenario.fly().log, scenario.bench()
        while bench.tick < CAPTURE - 50:
            bench.step()
        snapshot = bench.save()
        for _ in range(2):
            bench.restore(snapshot)
            while bench.tick < 450:
                bench.step()
                np.testing.assert_array_equal(bench.state.omega_base, log.omega_base[bench.tick])


def test_the_shipped_target_is_met_by_the_papers_mission(space_robot: Run, tmp_path: Path) -> None:
    """As the manual says; three seconds earlier the tool is elsewhere."""
    words = ["--orbit", "iss", "--event", "capture@{}:neighbouring_satellite"]
    for time, hits in (("15", True), ("12", False)):
        event = words[-1].format(time)
        options = [*words[:-1], event, "--duration", "15.1", "--json"]
        ran = space_robot("simulate", *options)
        assert ran.code == 0, ran.err
        report = json.loads(ran.out)
        assert report["events"] == [event]
        assert list(report["missed_captures"]) == ([] if hits else [event])


@pytest.mark.parametrize(
    ("motion", "said"),
    [
        ("{relative_to: tool, reach: 0.1}", "reach are for relative_to orbit, got 'tool'"),
        ("{relative_to: inertial, position: [1, 2, 3]}", "position are for relative_to orbit"),
        (
            "{position: [1, 2, 3], quaternion: [1, 0, 0, 0]}",
            "target.motion: position, quaternion are for relative_to orbit, got 'tool'",
        ),
        ("{relative_to: orbit, reach: 0}", "target.motion.reach: "),
        ("{relative_to: orbit, position: [1, 2]}", "target.motion.position: "),
        ("{relative_to: orbit}", "target 'drifter': motion.relative_to orbit needs an orbit: "),
    ],
)
def test_what_cannot_be_is_one_line(
    space_robot: Run, tmp_path: Path, motion: str, said: str
) -> None:
    """From a file: its name is in the line, unless all of the file is well."""
    file = tmp_path / "mine.yaml"
    file.write_text(
        "target: {name: drifter, mass: 1.0, inertia: [1, 1, 1, 0, 0, 0], motion: " + motion + "}"
    )
    ran = space_robot("simulate", "--duration", "0.1", "--event", f"capture@0.05:{file}")
    assert ran.code == 2
    assert said in ran.err
    assert ("mine.yaml" in ran.err) is ("needs an orbit" not in said)
    assert len(ran.err.strip().splitlines()) == 1
