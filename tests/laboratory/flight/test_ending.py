"""How a flight ended, and where its bag is written."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from space_robot.flight.bag_path import check_bag_path, default_bag
from space_robot.flight.ending import COMPLETE, DIVERGED, FAILED, UNANSWERED, Ending
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot_msgs_py.errors import (
    DivergedError,
    FlightError,
    InputError,
    SingularAttitudeError,
    UnusableStateError,
)

PERIOD = 5e-4


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
    plain = default_bag(Flight(resolve(FlightPlan(controller="ctc", case="4-1"))))
    assert plain.parent == Path("flights")
    assert plain.name.startswith("ctc_case4-1_")
    law_case, date, time = plain.name.rpartition("_")[0], *plain.name[-15:].split("-")
    assert law_case == "ctc_case4-1"
    assert (len(date), len(time)) == (8, 6)
    spaced = default_bag(Flight(resolve(FlightPlan(controller="ctc", namespace="/fleet/sat1"))))
    assert spaced.name.startswith("fleet_sat1_ctc_case1_")


def test_a_bag_is_never_overwritten_and_looking_leaves_nothing(tmp_path: Path) -> None:
    check_bag_path(tmp_path / "a" / "b")
    assert not list(tmp_path.iterdir())
    file, link = tmp_path / "file", tmp_path / "link"
    file.touch()
    link.symlink_to(tmp_path / "nothing")
    for taken in (tmp_path, file, link):
        with pytest.raises(InputError) as caught:
            check_bag_path(taken)
        assert str(caught.value) == f"{taken}: exists already; a bag is never overwritten"
    with pytest.raises(InputError) as caught:
        check_bag_path(file / "bag")
    assert str(caught.value).startswith(f"{file}/bag: no bag can be written there (")
    assert str(caught.value).endswith(f": {os.strerror(20)})")
    for name in ("a\0b", "a\ud800b"):
        with pytest.raises(InputError) as caught:
            check_bag_path(tmp_path / name)
        assert ": no name of a folder (" in str(caught.value)
        assert str(caught.value).isprintable()
    with pytest.raises(InputError, match=r"no bag can be written there .*too long"):
        check_bag_path(tmp_path / ("a" * 300))
