"""Copies of benches, environments and what they are made of: whole, apart, and to the same bits."""

from __future__ import annotations

import copy
import pickle
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium
import numpy as np
import pytest
from numpy.typing import NDArray
from test_bench_steps import RICH, fly_on, seen

from space_robot import Bench, Scenario
from space_robot.api.gymnasium_env import NAME
from space_robot_control.laws.ctc import ComputedTorque
from space_robot_msgs_py.compiled import records
from space_robot_msgs_py.samples import RobotState

COPIES: dict[str, Callable[[Any], Any]] = {
    "copy": copy.copy,
    "deepcopy": copy.deepcopy,
    "pickle": lambda thing: pickle.loads(pickle.dumps(thing)),
}
copies = pytest.mark.parametrize("copied", COPIES.values(), ids=COPIES)


def arrays_in(thing: Any, path: str, visited: set[int]) -> Iterator[tuple[str, NDArray[Any]]]:
    """Yield every array that an object reaches, with the path to it."""
    if isinstance(thing, np.ndarray):
        yield path, thing
        return
    if id(thing) in visited or isinstance(thing, (str, bytes, type)) or callable(thing):
        return
    visited.add(id(thing))
    inner: dict[Any, Any] = dict(getattr(thing, "__dict__", {}))
    inner |= {name: getattr(thing, name) for name in getattr(type(thing), "__slots__", ())}
    if isinstance(thing, dict):
        inner |= thing
    elif isinstance(thing, (list, tuple)):
        inner |= dict(enumerate(thing))
    for name, value in inner.items():
        yield from arrays_in(value, f"{path}.{name}", visited)


def memory_map(thing: Any) -> dict[str, tuple[str, int]]:
    """Return of each array the largest one in whose memory it lies, and where in it."""
    arrays = sorted(
        (a for a in arrays_in(thing, "", set()) if a[1].size), key=lambda a: (-a[1].nbytes, a[0])
    )
    found = {}
    for path, array in arrays:
        whole = next(a for a in arrays if np.may_share_memory(a[1], array))
        found[path] = whole[0], array.ctypes.data - whole[1].ctypes.data
    return found


@pytest.fixture
def bench() -> Bench:
    """In the middle of a fault, with commands on their way and a target in hand."""
    bench = RICH.bench()
    bench.reset(11)
    fly_on(bench, 45)
    return bench


@copies
def test_a_copied_bench_flies_on_to_the_same_bits(bench: Bench, copied: Any) -> None:
    """Past a swap of the law and the end of a fault; the original stands still meanwhile."""
    here, other = seen(bench), copied(bench)
    theirs = fly_on(other, 80)
    assert seen(bench) == here
    assert fly_on(bench, 80) == theirs
    assert other.reset().block.tobytes() == RICH.bench().state.block.tobytes()


@copies
def test_a_copy_has_the_same_views_of_memory_of_its_own(bench: Bench, copied: Any) -> None:
    """Whatever looks into a block looks into the copy's block, at the same place."""
    bench.controller.allocate  # noqa: B018
    bench.reference  # noqa: B018
    other = copied(bench)
    assert memory_map(other) == memory_map(bench)
    mine, theirs = (dict(arrays_in(thing, "", set())) for thing in (bench, other))
    for path, array in theirs.items():
        if array.flags.writeable and mine[path].flags.writeable:
            assert not np.may_share_memory(array, mine[path]), path
    signals = other.controller.signals
    assert signals.address == other.controller.block["signals"].ctypes.data


def test_compiled_code_knows_the_blocks_of_another_process(
    bench: Bench, monkeypatch: pytest.MonkeyPatch
) -> None:
    pickled = pickle.dumps(bench)
    monkeypatch.setattr(records, "_LAYOUTS", {})
    records._dtype.cache_clear()
    other = pickle.loads(pickled)
    for block in (other._plant.block, other.controller.block):
        assert records.layout_of(block.dtype) is not None
    records._dtype.cache_clear()


def test_a_copied_state_is_a_state() -> None:
    state = RobotState.allocate(2)
    for copied in COPIES.values():
        other = copied(state)
        other.joint_positions[1] = 3.0
        assert other.block["joint_positions"][0, 1] == 3.0
        assert state.joint_positions[1] == 0.0


def test_benches_of_one_flight_do_not_disturb_one_another() -> None:
    """Each has laws of its own: these remember."""
    flight = Scenario(controller="tde_stc", case="3", duration=0.05).check()
    alone = fly_on(Bench(flight), 40)
    one, other = Bench(flight), Bench(flight)
    fly_on(other, 7)
    together = []
    for _ in range(40):
        together += fly_on(one, 1)
        fly_on(other, 1)
    assert together == alone


def test_a_view_of_a_record_is_refused(bench: Bench) -> None:
    """Also one that a law under development keeps; a silent copy would look at the old memory."""

    class Kept(ComputedTorque):
        def __init__(self, *arguments: Any) -> None:
            super().__init__(*arguments)
            self.force_of_before = self.memory.force

    law = Kept(bench.flight.build_controller(bench.flight.laws["ctc"]).law.gain_values, 5e-4)
    for refused in (lambda: copy.deepcopy(law), law.save):
        with pytest.raises(TypeError, match=r"Kept\.force_of_before is a view of a record"):
            refused()
    for copied in COPIES.values():
        with pytest.raises(TypeError, match="copy the object that owns its block"):
            copied(bench.controller.signals)


@pytest.mark.parametrize("copied", [copy.deepcopy, COPIES["pickle"]])
def test_a_copied_environment_goes_on_to_the_same_rewards(copied: Any) -> None:
    """In its wrappers, and with the random numbers of the episodes to come."""
    made: Any = gymnasium.make(
        NAME, scenario=Scenario(controller=None, sensors="fine", duration=0.1)
    )
    made.reset(seed=3)
    actions = np.random.default_rng(0).uniform(-1.0, 1.0, (3, 9))
    made.step(actions[0])
    other = copied(made)

    def go_on(env: Any) -> list[Any]:
        steps = [env.step(action) for action in actions[1:]]
        return [(step[0].tobytes(), *step[1:]) for step in steps] + [env.reset()[0].tobytes()]

    assert go_on(other) == go_on(made)
