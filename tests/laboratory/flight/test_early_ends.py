"""How flights end, and where their bags are; one that ends early is in log and bag to its tick."""

from __future__ import annotations

import json
import os
import re
from collections import Counter
from collections.abc import Callable
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from flights import planned, space_robot_here

from space_robot.analysis import analyze
from space_robot.flight import compilation
from space_robot.flight.bag_path import check_bag_path, default_bag
from space_robot.flight.ending import COMPLETE, DIVERGED, FAILED, UNANSWERED, Ending
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import fly_blocks, simulate
from space_robot_control.laws import ControlLaw, LawGains, Signals, per_axis
from space_robot_control.laws.checked import LawError
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.bag.folder import open_bag
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import (
    DivergedError,
    FlightError,
    InputError,
    SingularAttitudeError,
    UnusableStateError,
)
from space_robot_msgs_py.samples import Command

AXES, PERIOD = 9, 5e-4
COLUMNS = (
    "base_position",
    "quaternion",
    "base_velocity",
    "omega_base",
    "joint_positions",
    "joint_velocities",
    "applied_torque",
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
        lambda: flight_of(gains="printed", swaps=["0.1:ctc"]),
        209,
        209,
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


@pytest.mark.parametrize("name", FLIGHTS)
def test_every_tick_is_in_log_and_bag(name: str, tmp_path: Path) -> None:
    """As classes have it that know no log, tick by tick; the report is that of the bag."""
    make, sent, answered, kind = FLIGHTS[name]
    blocks: list[FlightLog] = []
    with pytest.raises(kind):
        blocks.extend(fly_blocks(make(), tmp_path / "bag"))
    (log,), read = blocks, read_flight(tmp_path / "bag")
    assert (log.ticks, log.unanswered) == (sent, sent - answered)
    assert np.isnan(log.commanded_torque[answered:]).all()
    assert np.isnan(log.telemetry[answered:]).all()
    flight = make()
    swaps, controller = dict(flight.swaps), flight.controller
    with suppress(FlightError, LawError):
        for tick in range(flight.ticks):
            state = flight.plant.state
            for column in COLUMNS:
                values = getattr(state, column)
                np.testing.assert_array_equal(getattr(log, column)[tick], values, column)
            if tick in swaps:
                controller.law = swaps[tick]
            command = controller.update(state, flight.mission.chunk(tick, 1).references())
            np.testing.assert_array_equal(log.commanded_torque[tick], command.torque)
            flight.plant.step(Command(tick, command.torque))
    assert tick + 1 == sent
    if not answered:  # of commands that never came there is no column
        assert read.commanded_torque is None
        read.commanded_torque = np.full_like(read.applied_torque, np.nan)
    for column in (*COLUMNS, "commanded_torque", "reference_joints", "reference_base"):
        np.testing.assert_array_equal(getattr(read, column), getattr(log, column))
    assert read.laws == log.laws
    assert (read.unfinished, read.damage, read.unanswered) == ("", (), log.unanswered)
    messages = Counter(topic for topic, _ in open_bag(tmp_path / "bag").messages(*topics.ALL))
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
    assert {**analyze(log), "lost": None} == {**analyze(read), "lost": None}


def test_the_error_has_the_log() -> None:
    with pytest.raises(DivergedError) as caught:
        simulate(flight_of(gains="printed", swaps=["0.1:ctc"]))
    assert caught.value.log is not None
    assert caught.value.log.ticks == caught.value.tick == 209
    assert np.isfinite(caught.value.log.commanded_torque).all()


def test_the_command_prints_what_its_bag_says(tmp_path: Path) -> None:
    bag = tmp_path / "bag"
    result = space_robot_here("simulate", "--duration", "0.1", "--bag", str(bag), "--json")
    assert result.returncode == 0, result.stderr
    ended = {"outcome": "complete", "reason": "", "ended_at_s": 0.1}
    assert json.loads(result.stdout) == analyze(read_flight(bag)) | ended
    bag = tmp_path / "diverged"
    given = ("--controller", "ctc", "--gains", "printed", "--bag", str(bag))
    result = space_robot_here("simulate", *given)
    assert result.returncode == 1
    assert "diverged at tick 11 (t = 0.0055 s)" in result.stderr
    assert read_flight(bag).ticks == 11


@pytest.mark.parametrize(
    ("error", "outcome", "tick"),
    [
        (DivergedError(11, PERIOD, "too fast"), DIVERGED, 11),
        (UnusableStateError(3, "is not finite", "not finite"), UNANSWERED, 3),
        (SingularAttitudeError(0), UNANSWERED, 0),
        (FlightError("plant: the flight diverged at tick 1204 (t = 0.6 s)"), DIVERGED, 1204),
        (FlightError("plant has ended at tick 5"), FAILED, None),
    ],
)
def test_an_early_end_is_told_by_its_error(
    error: FlightError, outcome: str, tick: int | None
) -> None:
    end = Ending.early(error, PERIOD)
    seconds = None if tick is None else round(tick * PERIOD, 9)
    assert (end.outcome, end.tick, end.ended_at_s) == (outcome, tick, seconds)
    assert end.as_record() == {"outcome": outcome, "reason": str(error), "ended_at_s": seconds}
    with pytest.raises(FlightError) as caught:
        end.check()
    assert caught.value is error


def test_a_flight_to_its_end_has_no_reason() -> None:
    end = Ending.complete(3, 0.1)
    end.check()
    assert end == (COMPLETE, "", 3, 0.3, None), "as it is written, not 0.30000000000000004"


def test_a_bag_is_named_after_robot_law_case_and_time() -> None:
    plain = default_bag(planned(controller="ctc", case="4-1"))
    assert plain.parent == Path("flights")
    assert re.fullmatch(r"ctc_case4-1_\d{8}-\d{6}", plain.name)
    spaced = default_bag(planned(controller="ctc", namespace="/fleet/sat1"))
    assert spaced.name.startswith("fleet_sat1_ctc_case1_")


def test_a_bag_is_never_overwritten_and_looking_leaves_nothing(tmp_path: Path) -> None:
    check_bag_path(tmp_path / "a" / "b")
    assert not list(tmp_path.iterdir())
    file, link = tmp_path / "file", tmp_path / "link"
    file.touch()
    link.symlink_to(tmp_path / "nothing")
    for taken, said in (
        (tmp_path, "exists already; a bag is never overwritten"),
        (file, "exists already; a bag is never overwritten"),
        (link, "exists already; a bag is never overwritten"),
        (file / "bag", rf"no bag can be written there \(.*: {os.strerror(20)}\)"),
        (tmp_path / "a\0b", r"no name of a folder \("),
        (tmp_path / "a\ud800b", r"no name of a folder \("),
        (tmp_path / ("a" * 300), "no bag can be written there .*too long"),
    ):
        with pytest.raises(InputError, match=f": {said}") as caught:
            check_bag_path(taken)
        assert str(caught.value).isprintable()


def test_the_output_of_a_command_that_compiles_stays_clean(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with compilation.compiling("nothing"):
        pass
    captured = capsys.readouterr()
    assert captured.out == ""
    assert captured.err.startswith("compiling nothing (once an installation")
