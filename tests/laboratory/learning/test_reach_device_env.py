"""The task reach on a device, by its program compiled as C++ for this processor."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from cpu_device import CpuDevice

import space_robot as sr
from space_robot.gpu import cuda
from space_robot.learning.reach_device_env import ReachDeviceEnv
from space_robot_msgs_py.errors import InputError

COUNT, M = 12, 9
SHORT: dict[str, Any] = {"duration": 0.01, "ticks_per_step": 4}


@pytest.fixture(scope="module")
def there() -> Any:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(cuda, "find_device", CpuDevice)
        yield sr.make_vec("reach", num_envs=COUNT, device="gpu", **SHORT)


def test_episodes_have_the_bits_of_those_here(there: ReachDeviceEnv) -> None:
    """Through failures, ends and new beginnings, whose random numbers are drawn there."""
    here = sr.make_vec("reach", num_envs=COUNT, **SHORT)
    first, _ = here.reset(seed=7)
    assert np.array_equal(np.from_dlpack(there.reset(seed=7)[0]), first)
    random, ends = np.random.default_rng(1), np.zeros(2)
    for k in range(20):
        # some hit the joints so hard that the cost ends the episode
        actions = (
            random.uniform(-1.0, 1.0, (COUNT, M))
            * np.where(random.random(COUNT) < 0.2, 3e5, 1)[:, None]
        )
        expected, found = here.step(actions)[:4], there.step(actions)[:4]
        for one, other in zip(expected, found, strict=True):
            assert np.array_equal(one, np.from_dlpack(other)), k
        ends += [expected[2].sum(), expected[3].sum()]
    assert np.all(ends > COUNT)
    # without a seed the generators go on
    assert np.array_equal(here.reset()[0], np.from_dlpack(there.reset()[0]))


def test_nvrtc_compiles_the_program() -> None:
    pytest.importorskip("cuda.bindings.nvrtc")
    device = CpuDevice()
    ReachDeviceEnv(1, device)
    binary = cuda.compiled(device.texts[0], "sm_90", (*cuda.NVRTC_FLAGS, "-G"))
    assert binary.startswith(b"\x7fELF")


def test_an_array_of_the_device_is_not_copied(there: ReachDeviceEnv) -> None:
    there.reset(seed=3)
    observations = np.from_dlpack(there.observations)
    before = observations.copy()
    there.step(np.ones((COUNT, M)))
    assert not np.array_equal(observations, before)


@pytest.mark.parametrize(
    ("call", "said"),
    [
        (lambda envs: envs.step(np.zeros((COUNT, 2))), r"an array \(12, 9\) of float64"),
        (lambda envs: envs.step(np.zeros((COUNT, M), np.float32)), r"one \(12, 9\) of <f4"),
        (lambda envs: envs.reset(seed=2**32), "seed: 0 to 4294967284 is allowed"),
        (lambda envs: sr.make_vec("reach", device="tpu"), "unknown device 'tpu'"),
    ],
)
def test_wrong_arguments_are_told(
    there: ReachDeviceEnv, call: Callable[[Any], Any], said: str
) -> None:
    with pytest.raises(InputError, match=said):
        call(there)
