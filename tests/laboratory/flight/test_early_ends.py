"""How flights end, and where their bags are; one that ends early is in log and bag to its tick."""

from __future__ import annotations

import os
import re
import signal
import time
from collections import Counter
from collections.abc import Callable
from dataclasses import replace
from itertools import count
from pathlib import Path

import numpy as np
import pytest
from bags import messages_in
from flights import forked_space_robot, planned
from matrix.scenarios import difference

from space_robot.analysis import analyze
from space_robot.flight import compilation
from space_robot.flight.ending import COMPLETE, DIVERGED, FAILED, UNANSWERED, Ending
from space_robot.flight.flight_messages import check_bag_path, default_bag
from space_robot.flight.plan import Flight
from space_robot.flight.simulate import simulate
from space_robot_control.laws import Signals
from space_robot_control.laws.base import LawError
from space_robot_msgs_py import topics
from space_robot_msgs_py.bag.reader import read_flight
from space_robot_msgs_py.errors import (
    DivergedError,
    FlightError,
    InputError,
    SingularAttitudeError,
    UnusableStateError,
)

PERIOD = 5e-4
AT = 130


def fails() -> float:
    raise ZeroDivisionError


def failing(how: Callable[[], float]) -> Flight:
    """A flight whose law gives no torque, and fails at its tick 130."""
    tick = count()

    def law(signals: Signals) -> np.ndarray:
        return how() + 0.0 * signals.error if next(tick) == AT else 0.0 * signals.error

    return planned(controller=law, swaps=[], duration=2.0)


def singular() -> Flight:
    return planned(parameters={"plant": {"initial_quaternion": [0.0, 0.0, 1.0, 0.0]}})


@pytest.mark.parametrize(
    ("make", "sent", "answered", "kind"),
    [
        (lambda: planned(gains="printed", swaps=["0.1:ctc"]), 209, 209, DivergedError),
        (lambda: failing(lambda: np.nan), 131, 131, DivergedError),
        (singular, 1, 0, SingularAttitudeError),
        (lambda: failing(fails), 131, 130, LawError),
    ],
    ids=["diverged after a swap", "not finite", "singular attitude", "a law that fails"],
)
def test_every_tick_is_in_log_and_bag(
    make: Callable[[], Flight], sent: int, answered: int, kind: type[Exception], tmp_path: Path
) -> None:
    """The report is that of the bag."""
    with pytest.raises(kind) as caught:
        simulate(make(), tmp_path / "bag")
    read = read_flight(tmp_path / "bag")
    log = getattr(caught.value, "log", None)
    if log is None:  # that of a mistake in a law is in its bag only
        assert kind is LawError
        log = replace(read, telemetry=np.full((sent, 4, 9), np.nan))
    assert (log.ticks, log.unanswered) == (sent, sent - answered)
    assert np.isfinite(log.commanded_torque[: min(answered, 130)]).all()
    assert np.isnan(log.commanded_torque[answered:]).all()
    assert np.isnan(log.telemetry[answered:]).all()
    if not answered:  # of commands that never came there is no column
        assert read.commanded_torque is None
        read.commanded_torque = np.full_like(read.applied_torque, np.nan)
    assert difference(read, log, {"telemetry"}) == ""
    assert read.laws == log.laws
    assert (read.unfinished, read.damage, read.unanswered) == ("", (), log.unanswered)
    messages = Counter(topic for topic, _ in messages_in(tmp_path / "bag"))
    counts = {
        topics.JOINT_STATES: sent,
        topics.BASE_STATE: sent,
        topics.COMMAND: answered,
        topics.REFERENCE_JOINTS: -(-sent // 100),
        topics.REFERENCE_BASE: -(-sent // 100),
        topics.CLOCK: -(-sent // 20),
        topics.TELEMETRY: -(-answered // 20),
        topics.LAW: 2 if sent == 209 else min(answered, 1),
    }
    assert messages == {topic.full_name: count for topic, count in counts.items() if count}
    assert {**analyze(log), "lost": None} == {**analyze(read), "lost": None}
    if kind is DivergedError:
        assert caught.value.tick == sent


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


# Long ones


def test_a_long_flight_flies_and_can_be_interrupted(tmp_path: Path) -> None:
    """An hour, whose log is in files."""
    bag = tmp_path / "bag"
    process = forked_space_robot("simulate", "--duration", "3600", "--bag", str(bag))
    while not (bag / "bag_0.mcap").exists() or (bag / "bag_0.mcap").stat().st_size < 1_000_000:
        assert process.poll() is None
        time.sleep(0.02)
    process.send_signal(signal.SIGINT)
    _, said = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "Traceback" not in said
    assert read_flight(bag).unfinished == ""
    assert not list(bag.glob("*.part"))


def test_a_log_for_which_there_is_no_room_is_refused() -> None:
    with pytest.raises(
        InputError, match=r"1e\+06 s: the whole log needs .* GB are free: fly a short"
    ):
        simulate(planned(duration=1e6))
