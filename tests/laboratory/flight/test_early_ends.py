"""Flights that end before their time: every tick up to the one they end at is in log and bag."""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import space_robot_here

from space_robot.analysis import analyze
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import fly_blocks, simulate
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis
from space_robot_control.laws.checked import LawError
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import DivergedError, FlightError, SingularAttitudeError
from space_robot_msgs_py.samples import Command

AXES = 9
COLUMNS = (
    "base_position",
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
    "commanded_torque",
    "reference_joints",
    "reference_base",
)


class NoGains(LawGains):
    none: np.ndarray = per_axis("nothing")


class Failing(ControlLaw):
    """Gives no torque, and fails at a tick."""

    name = "failing"
    gains_type = NoGains

    def __init__(self, at: int, how: Callable[[], float]) -> None:
        super().__init__({"none": np.zeros(AXES)}, 0.0005)
        self.at, self.how, self.tick = at, how, -1

    def force(self, signals: Signals) -> np.ndarray:
        self.tick += 1
        return np.full(AXES, self.how() if self.tick == self.at else 0.0)


def fails() -> float:
    raise ZeroDivisionError


def flight_of(**options: Any) -> Flight:
    return Flight(resolve(FlightPlan.model_validate({"duration": 2.0, **options})))


def failing(at: int, how: Callable[[], float]) -> Flight:
    flight = flight_of()
    flight.controller.law = Failing(at, how)
    return flight


FLIGHTS: dict[str, tuple[Callable[[], Flight], int, int, type[Exception]]] = {
    # what is flown, states sent, states answered, how it ends
    "diverged": (lambda: flight_of(controller="ctc", gains="printed"), 11, 11, DivergedError),
    "diverged after a swap": (
        lambda: flight_of(gains="printed", swaps=["1.2:ctc"]),
        2410,
        2410,
        DivergedError,
    ),
    "not finite": (lambda: failing(130, lambda: np.nan), 131, 131, DivergedError),
    "singular attitude": (
        lambda: flight_of(parameters={"plant": {"initial_quaternion": [0.0, 0.0, 1.0, 0.0]}}),
        1,
        0,
        SingularAttitudeError,
    ),
    "a law that fails": (lambda: failing(130, fails), 131, 130, LawError),
}


def stepped(flight: Flight) -> list[list[np.ndarray]]:
    """The numbers of all states and commands, tick by tick, by classes that know no log."""
    found: list[list[np.ndarray]] = []
    swaps = dict(flight.swaps)
    try:
        for tick in range(flight.ticks):
            state, controller = flight.plant.state, flight.controller
            row = [getattr(state, name).copy() for name in COLUMNS[:7]]
            found.append(row)
            if tick in swaps:
                controller.law = swaps[tick]
            command = controller.update(state, flight.mission.chunk(tick, 1).references())
            row.append(command.torque.copy())
            flight.plant.step(Command(tick, command.torque))
    except (FlightError, LawError):
        pass
    return found


@pytest.fixture(scope="module", params=list(FLIGHTS))
def flown(
    request: pytest.FixtureRequest, tmp_path_factory: pytest.TempPathFactory
) -> tuple[str, list[FlightLog], Path]:
    make, *_, error = FLIGHTS[request.param]
    bag = tmp_path_factory.mktemp("bags") / "bag"
    blocks: list[FlightLog] = []
    with pytest.raises(error):
        blocks.extend(fly_blocks(make(), bag))
    return request.param, blocks, bag


def test_every_tick_is_in_the_log(flown: tuple[str, list[FlightLog], Path]) -> None:
    name, (log,), _ = flown
    make, sent, answered, _ = FLIGHTS[name]
    assert (log.ticks, log.unanswered) == (sent, sent - answered)
    rows = stepped(make())
    assert len(rows) == sent
    for tick, row in enumerate(rows):
        for column, values in zip(COLUMNS, row, strict=False):
            np.testing.assert_array_equal(getattr(log, column)[tick], values)
    assert log.commanded_torque is not None
    assert log.telemetry is not None
    assert np.isnan(log.commanded_torque[answered:]).all()
    assert np.isnan(log.telemetry[answered:]).all()


def test_every_tick_is_in_the_bag(flown: tuple[str, list[FlightLog], Path]) -> None:
    name, (log,), bag = flown
    _, sent, answered, _ = FLIGHTS[name]
    read = read_flight(bag)
    if not answered:  # of commands that never came there is no column
        assert read.commanded_torque is None
        read.commanded_torque = np.full_like(read.applied_torque, np.nan)
    for column in COLUMNS:
        np.testing.assert_array_equal(getattr(read, column), getattr(log, column))
    assert read.laws == log.laws
    assert (read.unfinished, read.damage, read.unanswered) == ("", (), log.unanswered)
    messages = Counter(topic for topic, _ in open_bag(bag).messages(*topics.ALL))
    counts = {
        topics.JOINT_STATES: sent,
        topics.BASE_STATE: sent,
        topics.COMMAND: answered,
        topics.REFERENCE_JOINTS: -(-sent // 100),
        topics.REFERENCE_BASE: -(-sent // 100),
        topics.CLOCK: -(-sent // 20),
        topics.TELEMETRY: -(-answered // 20),
        topics.LAW: 2 if "swap" in name else min(answered, 1),
    }
    assert messages == {topic.full_name: count for topic, count in counts.items() if count}


def test_the_report_of_what_was_flown_is_that_of_its_bag(
    flown: tuple[str, list[FlightLog], Path],
) -> None:
    _, (log,), bag = flown
    here, there = analyze(log), analyze(read_flight(bag))
    assert {**here, "lost": None} == {**there, "lost": None}


def test_the_error_has_the_log() -> None:
    with pytest.raises(DivergedError) as caught:
        simulate(flight_of(gains="printed", swaps=["1.2:ctc"]))
    log = caught.value.log
    assert log is not None
    assert log.ticks == caught.value.tick == 2410
    assert log.commanded_torque is not None
    assert np.isfinite(log.commanded_torque).all()


def test_the_command_leaves_a_whole_bag(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    given = ("--controller", "ctc", "--gains", "printed", "--bag", str(bag))
    result = space_robot_here("simulate", *given)
    assert result.returncode == 1
    assert "diverged at tick 11 (t = 0.0055 s)" in result.stderr
    assert read_flight(bag).ticks == 11


@pytest.mark.ros
def test_the_bag_is_that_of_the_graph(tmp_path: Path) -> None:
    """The same states, commands, laws, and stamps of telemetry and clock, to the last byte."""
    pytest.importorskip("rclpy")
    options = ("--gains", "printed", "--swap", "0.1:ctc")
    bags = {name: tmp_path / name for name in ("fly", "simulate")}
    for command, bag in bags.items():
        composed = ("--composed",) if command == "fly" else ()
        result = space_robot_here(command, *options, *composed, "--bag", str(bag))
        assert result.returncode == 1
        assert "diverged at tick 209 (t = 0.1045 s)" in result.stderr
    found: dict[str, dict[str, list[bytes]]] = {}
    for name, bag in bags.items():
        found[name] = {}
        for topic, data in open_bag(bag).messages(*topics.ALL):
            found[name].setdefault(topic, []).append(data)
    for topic, messages in found["simulate"].items():
        sent = found["fly"][topic]
        # the mission sends ahead of need
        assert messages == (sent[: len(messages)] if topic.startswith("/reference/") else sent)
