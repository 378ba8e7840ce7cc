"""The torque that is reported: of which source, with which errors, and what it does to a law."""

from __future__ import annotations

import numpy as np
import pytest
from actuator_bench import NAMES, PERIOD, Bench, N
from numpy.typing import NDArray

from space_robot_sim.actuators.torque_echo import TORQUE_BIAS, TORQUE_SCALE, WrongEcho
from space_robot_sim.faults.grammar import by_name, parse_faults
from space_robot_sim.faults.schedule import Schedule

Array = NDArray[np.float64]

TORQUES = 10.0 * np.random.default_rng(8).normal(size=(50, N + 3))
WRONG = {"drive_scale": [0.9], "drive_bias": [0.1], "drive_lag": [0.01]}


def test_the_command_within_its_limits_is_reported_whatever_the_drives_make_of_it() -> None:
    sound, wrong = Bench(joint_torque_limit=5.0), Bench(joint_torque_limit=5.0, **WRONG)
    for torque in TORQUES:
        reported, given = wrong.act(torque)
        assert (given != reported).all()
        for out in sound.act(torque):
            np.testing.assert_array_equal(reported, out)


def test_a_torque_sensor_reports_what_is_given() -> None:
    by_command, by_sensor = Bench(**WRONG), Bench(**WRONG, torque_echo="given")
    for torque in TORQUES:
        _, given = by_command.act(torque)
        for out in by_sensor.act(torque):
            np.testing.assert_array_equal(out, given)


@pytest.mark.parametrize("source", ["command", "given"])
def test_the_echo_has_a_scale_and_a_bias_of_its_own(source: str) -> None:
    scale, bias = np.linspace(0.9, 1.1, N + 3), np.linspace(-1.0, 1.0, N + 3)
    errors = {"echo_scale": scale.tolist(), "echo_bias": bias.tolist(), "torque_echo": source}
    sound, wrong = Bench(**WRONG), Bench(**WRONG, **errors)
    for torque in TORQUES:
        reported, given = sound.act(torque)
        of = reported if source == "command" else given
        found, still_given = wrong.act(torque)
        np.testing.assert_array_equal(still_given, given)
        np.testing.assert_allclose(found, scale * of + bias, rtol=1e-15, atol=1e-15)


def test_faults_of_the_echo_leave_what_is_given() -> None:
    texts = ("torque_scale@0.005-0.015:base=0.5", "torque_bias@0.01-0.015:5=3")
    kinds = by_name(TORQUE_SCALE, TORQUE_BIAS)
    faults = WrongEcho(Schedule(parse_faults(texts, kinds), 0, PERIOD, NAMES))
    actuators = Bench()
    for tick, torque in enumerate(TORQUES):
        faults.apply(tick, actuators.record.torque_echo)
        reported, given = actuators.act(torque)
        np.testing.assert_array_equal(given, torque)
        scale, bias = np.ones(N + 3), np.zeros(N + 3)
        scale[:3] = 0.5 if 10 <= tick < 30 else 1.0
        bias[7] = 3.0 if 20 <= tick < 30 else 0.0
        np.testing.assert_allclose(given, scale * reported + bias, rtol=1e-15, atol=1e-14)
        if tick < 10 or tick >= 30:
            assert reported.tobytes() == torque.tobytes()
