"""`space_robot.load_bag`, and the example of the documentation."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from paths import DOCS

from space_robot import load_bag
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog

DOCUMENT = DOCS / "manual/bags.md"


@pytest.fixture(scope="module")
def bag(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("bags") / "flights" / "one"
    simulate(Flight(resolve(FlightPlan(duration=0.2))), folder)
    return folder


def test_arrays_have_the_shapes_they_say(bag: Path) -> None:
    log = load_bag(str(bag))
    n = len(log.joint_names)
    assert log.description["controller"] == "tde_stc"
    np.testing.assert_allclose(log.time, np.arange(400) * 0.0005)
    for array, shape in (
        (log.quaternion, (4,)),
        (log.angular_velocity, (3,)),
        (log.base_position, (3,)),
        (log.base_velocity, (3,)),
        (log.joint_positions, (n,)),
        (log.joint_velocities, (n,)),
        (log.applied_torque, (n + 3,)),
        (log.commanded_torque, (n + 3,)),
        (log.reference_joints, (3, n)),
        (log.reference_base, (10,)),
    ):
        assert array is not None
        assert array.shape == (400, *shape)
        assert array.dtype == np.float64
        assert array.flags.c_contiguous


def test_longest_stretch_is_the_longest_without_a_gap(bag: Path) -> None:
    log = load_bag(bag)
    assert log.longest_stretch().ticks == 400
    log.quaternion[100], log.reference_base[350] = np.nan, np.nan
    assert np.flatnonzero(~log.whole).tolist() == [100, 350]
    stretch = log.longest_stretch()
    assert (stretch.first_tick, stretch.ticks) == (101, 249)
    assert stretch.whole.all()
    assert stretch.time[0] == pytest.approx(0.0505)
    log.joint_positions[:] = np.nan
    assert log.longest_stretch().ticks == 0
    assert isinstance(stretch, FlightLog)


def test_import_does_not_bring_in_what_reads_bags() -> None:
    code = (
        "import sys, space_robot_sim; "
        "print([m for m in ('mcap', 'rosbags', 'zstandard') if m in sys.modules])"
    )
    result = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=True
    )
    assert result.stdout.strip() == "[]"


@pytest.mark.parametrize("number", range(2))
def test_examples_of_the_documentation_run(
    bag: Path, monkeypatch: pytest.MonkeyPatch, number: int
) -> None:
    examples = re.findall(r"```python\n(.*?)```", DOCUMENT.read_text(), re.DOTALL)
    assert len(examples) == 2
    monkeypatch.chdir(bag.parents[1])
    exec(compile(examples[number], str(DOCUMENT), "exec"), {})
