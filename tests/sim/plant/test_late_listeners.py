"""A paused plant repeats its messages for those who join, and for nobody else."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from space_robot_sim.plant.late_listeners import MOST_S, PERIOD_S, LateListeners

LOOK_S = 0.02


@dataclass
class Output:
    listener_count: int


def times(late: LateListeners, start: float, stop: float) -> list[float]:
    """When the messages are repeated, between two times."""
    return [float(now) for now in np.arange(start, stop, LOOK_S) if late.are_due(float(now))]


@pytest.mark.parametrize("which", [0, 1])
def test_each_of_the_outputs_has_listeners_that_may_join(which: int) -> None:
    outputs = [Output(2), Output(0)]
    late = LateListeners(outputs)
    late.begin()
    assert times(late, 1.0, 3.0) == []
    outputs[which].listener_count += 1
    repeated = times(late, 3.0, 10.0)
    assert repeated[0] == 3.0, "at once"
    assert np.diff(repeated) == pytest.approx(PERIOD_S, abs=LOOK_S)
    assert repeated[-1] < 3.0 + MOST_S
    assert len(repeated) == round(MOST_S / PERIOD_S)
    outputs[which].listener_count -= 1
    assert times(late, 10.0, 12.0) == [], "who leaves needs nothing"
    outputs[which].listener_count += 1
    assert times(late, 12.0, 12.1) == [12.0], "who joins again does"


def test_who_leaves_one_topic_does_not_hide_who_joins_another() -> None:
    outputs = [Output(1), Output(1)]
    late = LateListeners(outputs)
    assert not late.are_due(0.0)
    outputs[0].listener_count, outputs[1].listener_count = 0, 2
    assert late.are_due(0.1)


def test_who_joined_while_the_plant_ran_has_had_its_messages() -> None:
    outputs = [Output(1)]
    late = LateListeners(outputs)
    assert not late.are_due(0.0)
    late.begin()
    outputs[0].listener_count = 2
    late.begin()
    assert times(late, 1.0, 2.0) == []
