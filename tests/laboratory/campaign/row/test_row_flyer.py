"""One task to its row: whatever happens, there is a row, and it tells what happened."""

from __future__ import annotations

import pickle
from typing import Any

import numpy as np
import pytest

from space_robot import Scenario
from space_robot.campaign.row import fly
from space_robot.campaign.row.fly import RowFlyer
from space_robot.campaign.row.row import Row, Task
from space_robot.campaign.study import Study
from space_robot_msgs_py.errors import InputError

TASK = Task(1, "tde_stc")


def flyer(**scenario: Any) -> RowFlyer:
    content = {
        "scenario": {"duration": 0.1, **scenario},
        "laws": ["tde_stc", "tde_smc"],
        "vary": {"scenario.case": {"choice": ["1", "3"]}},
        "require": {"p": {"metric": "attitude_max", "below": 1.0, "in": 0.9}},
    }
    return RowFlyer.of(Study.model_validate(content), 3, 5)


def test_a_row_is_the_same_whenever_and_however_it_is_flown() -> None:
    one, fresh = flyer(sensors="fine"), pickle.loads(pickle.dumps(flyer(sensors="fine")))
    first, again = one(TASK), fresh(TASK)
    assert first.digest == again.digest
    assert first.outcome == "complete"
    flown = one.draws.scenario(*TASK).fly()
    row = one.row_of_log(TASK, flown.flight, flown.ending, flown.log)
    assert row.digest == first.digest
    assert one(Task(2, "tde_stc")).digest != first.digest


def test_a_flight_that_ends_early_has_its_reason_and_no_numbers() -> None:
    row = flyer(faults=["torque_scale@0:all=0.5"], duration=20.0)(TASK)
    assert row.outcome in ("diverged", "unanswered")
    assert "tick" in row.reason
    assert row.ended_at_s is not None
    assert not row.metrics
    assert not row.require
    assert row.digest


def test_a_draw_that_makes_no_flight_is_refused(monkeypatch: pytest.MonkeyPatch) -> None:
    def refuse(self: Scenario) -> None:
        raise InputError("no such robot")

    flying = flyer()
    values = flying.draws.values(1)
    monkeypatch.setattr(Scenario, "check", refuse)
    row = flying(TASK)
    assert row.outcome == "refused"
    assert "no such robot" in row.reason
    assert row.vary == values


def test_a_mistake_in_the_code_is_a_row(monkeypatch: pytest.MonkeyPatch) -> None:
    def fail(*_: object) -> None:
        raise ZeroDivisionError("division\nby zero")

    flying = flyer()
    monkeypatch.setattr(fly, "fly_blocks", fail)
    row = flying(TASK)
    assert (row.outcome, row.reason) == ("failed", "ZeroDivisionError: division by zero")
    assert row.vary


def test_a_digest_covers_every_number() -> None:
    band = np.arange(3, dtype=np.float32)
    row = Row(TASK, "complete", "", 1.0, {"a": 1.0, "b": "x"}, {"m": 2.0}, {"r": 3.0}, {"s": band})
    parts: list[dict[str, Any]] = [
        {"outcome": "diverged"},
        {"reason": "why"},
        {"ended_at_s": 1.5},
        {"vary": {"a": 1.0}},
        {"vary": {"a": 1.0, "b": "y"}},
        {"metrics": {"m": np.nextafter(2.0, 3.0)}},
        {"require": {"r": -3.0}},
        {"bands": {"s": np.nextafter(band, np.float32(9))}},
    ]
    digests = {Row(**{**row.__dict__, **part}).digested().digest for part in parts}
    digests |= {row.digested().digest, row.digested(b"state").digest}
    assert len(digests) == len(parts) + 2
    assert Row(**{**row.__dict__, "task": Task(7, "ctc")}).digested().digest in digests


def test_a_flight_that_diverges_among_joints_that_stop_comes_to_its_end() -> None:
    """Near its end velocities have several roots in a step: cutting it never ended."""
    content = {
        "scenario": {"case": "3", "sensors": "fine", "duration": 5.0},
        "laws": ["ctc"],
        "vary": {"robot.links[*].mass": {"normal": 1.0, "sigma": 0.05, "relative": True}},
    }
    flying = RowFlyer.of(Study.model_validate(content), 7, 150)
    row = flying(Task(89, "ctc"))
    assert (row.outcome, row.ended_at_s) == ("diverged", pytest.approx(2.602))
    (other,) = [r for r in flying.together([Task(88, "ctc"), Task(89, "ctc")]) if r.task.run == 89]
    assert other.digest == row.digest


def test_runs_flown_together_have_the_rows_of_single_ones() -> None:
    flying = flyer(sensors="fine", faults=["torque_scale@0.03:all=0.3"])
    tasks = [Task(run, "tde_stc") for run in range(5)]
    rows = {row.task: row for row in flying.together(tasks)}
    assert rows.keys() == set(tasks)
    for task, row in rows.items():
        assert row.digest == flying(task).digest
        assert row.metrics == flying(task).metrics
