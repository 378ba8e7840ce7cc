"""Figures of merit against hand-made signals with known values."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from scipy.signal import periodogram

from space_robot_control.analysis import analyse, tracking_error
from space_robot_control.analysis.metrics import (
    axis_groups,
    eq64_rms,
    mean_axis_rms,
    power_above,
    total_variation_per_second,
)
from space_robot_control.flight.plan import Flight, FlightPlan
from space_robot_control.flight.simulate import simulate
from space_robot_msgs_py.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005


def test_the_two_definitions_differ_as_the_paper_has_them() -> None:
    values = np.tile([3.0, 0.0, 4.0], (10, 1))
    assert mean_axis_rms(values) == pytest.approx(7.0 / 3.0)
    assert eq64_rms(values) == pytest.approx(5.0 / 3.0)


@given(arrays(np.float64, (20, 3), elements=st.floats(-1e3, 1e3)))
def test_definitions_bound_each_other(values: np.ndarray) -> None:
    """Norms: |x|_2 <= |x|_1 <= sqrt(3) |x|_2 of the three axes' RMS."""
    mean, eq64 = mean_axis_rms(values), eq64_rms(values)
    assert eq64 <= mean * (1.0 + 1e-12) + 1e-12
    assert mean <= math.sqrt(3.0) * eq64 * (1.0 + 1e-12) + 1e-12


def test_total_variation_of_a_ramp_and_of_chatter() -> None:
    time = np.arange(2001) * PERIOD
    ramp = np.column_stack([2.0 * time, -4.0 * time, 0.0 * time])
    assert total_variation_per_second(ramp, PERIOD) == pytest.approx(2.0)
    chatter = np.tile([[0.1], [-0.1]], (1000, 1))
    assert total_variation_per_second(chatter, PERIOD) == pytest.approx(0.2 / PERIOD)


def test_power_above_separates_slow_from_fast() -> None:
    time = np.arange(8000) * PERIOD
    slow, fast = np.sin(2 * np.pi * 3.0 * time), np.sin(2 * np.pi * 400.0 * time)
    assert power_above(slow[:, np.newaxis], PERIOD) < 1e-12
    assert power_above(fast[:, np.newaxis], PERIOD) == pytest.approx(1.0)
    assert power_above((2.0 * slow + fast)[:, np.newaxis], PERIOD) == pytest.approx(0.2, rel=1e-3)
    assert power_above(np.zeros((100, 2)), PERIOD) == 0.0


def test_power_above_is_scipys_periodogram() -> None:
    values = np.cumsum(np.random.default_rng(1).normal(size=(5000, 3)), axis=0)
    window = np.hanning(5000)
    f, power = periodogram(values, fs=1 / PERIOD, window=window, detrend=False, axis=0)
    share = power[f > 100.0].sum(axis=0) / power.sum(axis=0)
    assert power_above(values, PERIOD) == pytest.approx(share.mean(), rel=1e-9)


@pytest.mark.parametrize(
    ("n", "keys"),
    [(1, ["1_1"]), (3, ["1_3"]), (4, ["1_3", "4_4"]), (6, ["1_3", "4_6"]), (7, ["1_3", "4_7"])],
)
def test_groups_cover_every_axis_once(n: int, keys: list[str]) -> None:
    groups = axis_groups(n)
    assert list(groups) == ["base", *keys]
    covered = np.concatenate([np.arange(n + 3)[axes] for axes in groups.values()])
    assert covered.tolist() == list(range(n + 3))


def test_error_is_measured_on_the_near_side_of_the_two_quaternions() -> None:
    log = FlightLog.allocate(2, ("j",), Timebase(500_000))
    log.quaternion[:] = [1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]
    angle = 1e-3
    log.reference_base[:] = 0.0
    log.reference_base[:, 0], log.reference_base[:, 1] = math.cos(angle), math.sin(angle)
    log.joint_positions[:], log.reference_joints[:] = 0.25, 1.0
    error = tracking_error(log)
    np.testing.assert_allclose(error[0], [math.sin(angle), 0.0, 0.0, 0.75], atol=1e-15)
    np.testing.assert_allclose(error[1], [-math.sin(angle), 0.0, 0.0, 0.75], atol=1e-15)


def test_report_has_the_documented_keys() -> None:
    report = analyse(simulate(Flight(FlightPlan(duration=0.1))))
    six = ["attitude", "joints_1_3", "joints_4_6", "base_torque", "torque_1_3", "torque_4_6"]
    assert list(report["rms"]["mean_axis"]) == list(report["rms"]["eq64"]) == six
    for chatter in report["chatter"].values():
        assert list(chatter) == six[3:]
    assert (report["controller"], report["case"]) == ("tde_stc", "1")
    assert (report["ticks"], report["duration_s"]) == (200, 0.1)
