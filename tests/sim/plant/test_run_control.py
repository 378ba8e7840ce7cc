"""Up to which tick the plant may go."""

from __future__ import annotations

import pytest

from space_robot_msgs_py.errors import InputError
from space_robot_sim.plant.run_control import RunControl


def run(control: RunControl, ticks: int) -> int:
    """Fly on until the control holds the plant, or for so many ticks; the tick reached."""
    for _ in range(ticks):
        if control.holds():
            break
        control.begin(control.tick + 1)
    return control.tick


def test_it_runs_until_it_is_paused_and_on_when_it_is_resumed() -> None:
    control = RunControl()
    assert run(control, 5) == 5
    assert control.pause()
    assert control.is_paused
    assert not control.is_held, "this tick's work is not done yet"
    assert run(control, 5) == 5
    assert control.is_held
    assert not control.pause(), "it is paused already"
    assert control.resume()
    assert not control.resume(), "it runs already"
    assert not control.is_held
    assert run(control, 5) == 10


def test_a_step_is_so_many_ticks_and_no_more() -> None:
    control = RunControl(is_paused=True)
    assert run(control, 5) == 0
    assert control.step(3) == 3
    assert control.is_paused
    assert not control.is_held, "at the start of a step, where it was held until now"
    assert run(control, 1) == 1
    with pytest.raises(InputError, match="a step to tick 3 is under way"):
        control.step(1)
    assert run(control, 9) == 3
    assert control.is_held
    assert control.step(1) == 4
    assert run(control, 9) == 4


def test_a_pause_ends_a_step() -> None:
    control = RunControl(is_paused=True)
    control.step(100)
    run(control, 2)
    assert control.pause()
    assert run(control, 9) == 2
    assert control.is_held


@pytest.mark.parametrize("ticks", [0, -1])
def test_a_step_of_no_ticks_is_refused(ticks: int) -> None:
    control = RunControl(is_paused=True)
    with pytest.raises(InputError, match=f"1 tick or more, got {ticks}"):
        control.step(ticks)
    assert run(control, 9) == 0


def test_what_runs_cannot_be_stepped() -> None:
    control = RunControl()
    with pytest.raises(InputError, match="only a paused simulation"):
        control.step(1)
    assert not control.is_paused
