"""Flights on a device, by their programs compiled as C++ for this processor."""

from __future__ import annotations

import sys
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner
from cpu_device import CpuDevice, CpuProgram
from matrix.scenarios import difference

import space_robot as sr
from space_robot.cli.main import cli
from space_robot.gpu import batch, cuda, dlpack
from space_robot.gpu.device import DeviceError
from space_robot.gpu.fly import RESERVE, fly_on_device
from space_robot_msgs_py.errors import InputError

STUDY: dict[str, Any] = {
    "runs": 9,
    "laws": ["tde_stc", "ctc"],
    "scenario": {"duration": 0.05, "sensors": "fine", "case": "3"},
    "vary": {"robot.base.mass": {"uniform": [0.8, 1.2], "relative": True}},
}


@pytest.fixture
def device(monkeypatch: pytest.MonkeyPatch) -> CpuDevice:
    """Let this processor stand for the GPU."""
    own = CpuDevice()
    monkeypatch.setattr(cuda, "find_device", lambda: own)
    return own


def test_scenarios_of_two_laws_fly_on_the_device(device: CpuDevice) -> None:
    scenarios = [
        sr.Scenario(controller=law, seed=seed, sensors="fine", duration=0.02)
        for seed in (1, 2)
        for law in ("tde_stc", "indi")
    ]
    done: list[int] = []
    flown = sr.fly_many(scenarios, device="gpu", progress=done.append)
    for one, scenario in zip(flown, scenarios, strict=True):
        assert difference(one.log, scenario.fly().log) == ""
    assert done == [2, 4]
    assert len(device.texts) == 2


def test_other_masses_and_gains_need_no_other_program(device: CpuDevice) -> None:
    scenario = sr.Scenario(duration=0.002)
    heavy = scenario.replace(parameters={"plant": {"friction.coulomb": 3.0}}, seed=5)
    for each in (scenario, heavy, scenario.replace(gains={"k_1": 2.0})):
        fly_on_device([each.check()], device)
    assert len(set(device.texts)) == 1


def test_a_campaign_has_the_same_table(device: CpuDevice) -> None:
    here = sr.Campaign.of(STUDY).run(workers=0)
    there = sr.Campaign.of(STUDY).run(workers=0, device="gpu")
    assert there.table.equals(here.table)
    assert len(device.texts) == 2


def test_laws_that_remember_alike_keep_memories_of_their_own(
    device: CpuDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Both have integrals, in records of one class, over many launches."""
    monkeypatch.setattr(batch, "MOST_STRETCH", 7)
    scenario = sr.Scenario(controller="pd", swaps=["0.02:ctc", "0.03:pd"], duration=0.04)
    laws = scenario.check().laws
    gains = {name: {**laws[name].gain_values, "k_i": [50.0] * 9} for name in ("pd", "ctc")}
    scenario = scenario.replace(gains=gains, parameters={"plant": {"friction.coulomb": 5.0}})
    (flown,) = fly_on_device([scenario.check()], device)
    assert difference(flown.log, scenario.fly().log) == ""


def test_fewer_fly_at_a_time_where_memory_is_little(capsys: pytest.CaptureFixture[str]) -> None:
    scenario = sr.Scenario(sensors="fine", duration=0.01)
    flights = [scenario.replace(seed=k).check() for k in range(4)]
    small = CpuDevice(int((batch.LOG_BYTES + 300_000) / RESERVE))
    flown = fly_on_device(flights, small)
    assert [one.flight for one in flown] == [0, 1, 2, 3]
    assert "little memory is free: 2 flights at a time" in capsys.readouterr().err
    for one, seed in zip(flown, range(4), strict=True):
        expected = scenario.replace(seed=seed).fly()
        assert np.array_equal(one.log.commanded_torque, expected.log.commanded_torque)
    with pytest.raises(DeviceError, match=r"a flight needs 0\.0 GB: 1\.0 GB of this processor"):
        fly_on_device(flights, CpuDevice(1_000_000_000))


def test_a_device_that_fails_ends_a_campaign_in_one_line(
    device: CpuDevice, monkeypatch: pytest.MonkeyPatch
) -> None:
    """It does not fly on, one by one, without it."""

    def fail(*_: Any) -> None:
        raise DeviceError("launch failed")

    monkeypatch.setattr(CpuProgram, "run", fail)
    with pytest.raises(DeviceError, match="launch failed"):
        sr.Campaign.of(STUDY).run(workers=0, device="gpu")


def test_arrays_are_given_without_a_copy_and_freed() -> None:
    memory = CpuDevice().store(np.arange(6.0).reshape(2, 3))
    array = np.from_dlpack(memory)
    memory.write(np.ones((1, 3)), 1)
    assert np.array_equal(array, [[0.0, 1.0, 2.0], [1.0, 1.0, 1.0]])
    assert len(dlpack._in_use) == 1
    refused = memory.__dlpack__()
    assert len(dlpack._in_use) == 2
    del array, refused
    assert not dlpack._in_use
    with pytest.raises(BufferError, match="without a copy"):
        memory.__dlpack__(copy=True)


def test_nvrtc_compiles_the_program_for_devices(device: CpuDevice) -> None:
    """As it does on a computer with a device; it needs none. With -G it does not optimise."""
    hardware = {"sensors": "fine", "navigation": "filtered", "actuators": "wheels_and_thrusters"}
    fly_on_device([sr.Scenario(**hardware, duration=0.001).check()], device)
    for architecture in ("sm_80", "sm_90"):
        binary = cuda.compiled(device.texts[0], architecture, (*cuda.NVRTC_FLAGS, "-G"))
        assert binary.startswith(b"\x7fELF")
    with pytest.raises(InputError, match=r"NVRTC cannot compile the flights: .*error"):
        cuda.compiled("int f( {", "sm_90")


def test_no_device_is_one_line_and_exit_code_2(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "cuda.bindings", None)
    cuda.find_device.cache_clear()
    result = CliRunner().invoke(cli, ["campaign", "run", "first", "--device", "gpu"])
    assert isinstance(result.exception, InputError)
    assert str(result.exception).startswith("device gpu: cuda-bindings is not installed: pip")
    cuda.find_device.cache_clear()


def test_a_wrong_device_is_told() -> None:
    with pytest.raises(InputError, match="unknown device 'tpu': choose one of cpu, gpu"):
        sr.fly_many([], device="tpu")
