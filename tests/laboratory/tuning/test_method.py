"""The method of ``gains tune`` against what it promises; noise and lag against formulas."""

from __future__ import annotations

import functools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.flight.plan import Flight, Scenario, resolve
from space_robot.tuning.gain_check import eigenvalues
from space_robot.tuning.inertia import SAMPLING, Posture, inertia_along, postures_along
from space_robot.tuning.method import Tuned, tune
from space_robot.tuning.task import (
    ForceDemand,
    Noise,
    TuningOptions,
    axis_inertia,
    force_demand,
    listen,
)
from space_robot_msgs_py.errors import InputError

Array = np.ndarray
PERIOD = 5e-4


@functools.cache
def scene(robot: str = "paper") -> tuple[Array, list[Posture], ForceDemand]:
    """H_S with the least and the largest payload, nominal postures, and what is asked for."""
    flights = [Flight(resolve(Scenario(robot=robot, case=case))) for case in ("1", "4-2")]
    first = flights[0]
    inertias = [inertia_along(x.plant.robot, first.mission_settings) for x in flights]
    cases = [x.plant_settings for x in flights]
    postures = postures_along(first.robot, first.mission_settings, SAMPLING)
    return (
        np.concatenate(inertias),
        postures,
        force_demand(first.robot, first.mission_settings, cases),
    )


def tuned(options: TuningOptions, robot: str = "paper", lag: float = 0.0) -> Tuned:
    still = np.zeros((100, scene(robot)[0].shape[-1]))
    return tune(*scene(robot), options, PERIOD, Noise(still, still, still, lag, PERIOD))


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
@pytest.mark.parametrize("margin", [0.01, 0.05])
@pytest.mark.parametrize("share", [0.0, 0.2])
def test_the_margin_is_left_with_the_worst_masses(robot: str, margin: float, share: float) -> None:
    found, (inertia, *_) = tuned(TuningOptions(margin, share), robot), scene(robot)
    h_bar = np.asarray(found.laws["tde_stc"].gains["h_bar"])
    heavy, light = (eigenvalues(factor * inertia, h_bar) for factor in (1.0 + share, 1.0 - share))
    assert heavy.min() == pytest.approx(margin, rel=0.01)  # gains are rounded
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD) if found.corner_hz else 1.0
    assert weight * light.max() < 1.01
    for law in ("tde_smc", "tde_tsmc"):
        np.testing.assert_array_equal(found.laws[law].gains["h_bar"], h_bar)


def test_poles_are_those_of_the_bandwidth() -> None:
    found = tuned(TuningOptions(0.05, 0.2))
    assert found.design.bandwidth == pytest.approx(0.05 / found.design.delay / 4.0)
    for law, bandwidth in (("tde_tsmc", found.design.bandwidth), ("ctc", found.model_bandwidth)):
        roots = np.roots([1.0, *(float(found.laws[law].gains[name][0]) for name in ("k_d", "k_p"))])
        assert np.abs(roots) == pytest.approx([bandwidth] * 2, rel=0.02)
    assert found.model_bandwidth == pytest.approx(0.05 / PERIOD)
    assert tuned(TuningOptions(0.05, 0.2), lag=0.02).model_bandwidth == pytest.approx(12.5)
    # with the lag of the estimate, a pole at margin / T
    pole = 0.05 / found.design.delay
    slow = np.roots([1.0 / pole, 1.0, 2.0 * found.design.bandwidth, found.design.bandwidth**2])
    pair = slow[np.abs(slow.imag) > 0.0]
    assert -pair[0].real / abs(pair[0]) == pytest.approx(0.7, abs=0.02)


def test_conditions_of_the_laws_hold() -> None:
    found = tuned(TuningOptions(0.05, 0.2))
    stc, smc, layer = (found.laws[law].gains for law in ("tde_stc", "tde_smc", "ctc_smc"))
    rate = found.design.bandwidth * found.design.error
    assert np.all(stc["k_2"] > rate)
    assert np.all(stc["k_1"] ** 2 > 4.0 * stc["k_2"])
    np.testing.assert_allclose(smc["g"], smc["h_bar"] * found.design.error, rtol=0.02)
    inertia = scene()[0]
    inside = eigenvalues(0.8 * inertia, layer["g"] / layer["delta"])  # s fades with these, 1/s
    assert inside.max() == pytest.approx(found.model_bandwidth, rel=0.02)


def test_a_bandwidth_beyond_the_estimates_is_refused() -> None:
    assert tuned(TuningOptions(0.05, 0.2, bandwidth=3.0)).laws["ctc"].gains["k_p"][0] == 9.0
    with pytest.raises(InputError, match=r"at most 13\.\d rad/s.*got 20"):
        tuned(TuningOptions(0.05, 0.2, bandwidth=20.0))


def test_adrc_has_less_inertia_where_its_three_poles_would_be_unstable() -> None:
    """``(s + omega_o)^3 = (1 - lambda) omega_o^3`` has no growing root for lambda below 9."""
    found = tuned(TuningOptions(0.05, 0.2), "seven_joint")
    inertia, h_bar = found.laws["adrc"].gains["inertia"], found.laws["tde_stc"].gains["h_bar"]
    assert np.all(np.asarray(inertia) < h_bar)
    largest = eigenvalues(0.8 * scene("seven_joint")[0], np.asarray(inertia)).max()
    assert largest == pytest.approx(5.0, rel=0.01)


@given(st.integers(0, 2**32 - 1), st.integers(2, 9))
@settings(max_examples=30, deadline=None)
def test_the_shape_is_near_the_best_diagonal(seed: int, m: int) -> None:
    """Van der Sluis: no diagonal matrix has a ratio of eigenvalues m times smaller."""
    rng = np.random.default_rng(seed)
    root = rng.normal(size=(m, m)) * 10.0 ** rng.uniform(-2.0, 2.0, m)
    inertia = (root.T @ root + 1e-3 * np.diag(np.diag(root.T @ root)))[np.newaxis]

    def ratio(diagonal: Array) -> float:
        values = eigenvalues(inertia, diagonal)
        return float(values.max() / values.min())

    ours = ratio(axis_inertia(inertia))
    for _ in range(20):
        other = axis_inertia(inertia) * 10.0 ** rng.uniform(-1.0, 1.0, m)
        assert ours <= m * ratio(other) * (1.0 + 1e-6)


def white(rate: float, angle: float = 0.0, ticks: int = 8000) -> Noise:
    """White noise of rates, rad/s (eps: 1/s), and of angles, rad, alike on all axes."""
    rng, shape = np.random.default_rng(1), (ticks, 9)
    rates = rate * rng.normal(size=shape)
    return Noise(rates, angle * rng.normal(size=shape), rates, 0.0, PERIOD)


def test_noise_is_kept_within_the_ripple_allowed() -> None:
    inertia, postures, asked = scene()
    options = TuningOptions(0.05, 0.2, ripple=0.1)
    quiet, loud = (
        tune(inertia, postures, asked, options, PERIOD, noise=white(x)) for x in (1e-9, 1e-5)
    )
    assert quiet.corner_hz == tuned(options).corner_hz
    weight = 1.0 - np.exp(-2.0 * np.pi * loud.corner_hz * PERIOD)
    share = loud.laws["tde_stc"].gains["h_bar"] * weight / PERIOD * 1e-5 / asked.peak
    assert share.max() == pytest.approx(0.1, rel=0.05)
    assert loud.design.bandwidth == pytest.approx(0.05 / loud.design.delay / 4.0, rel=1e-3)


def test_noise_beyond_any_low_pass_is_refused() -> None:
    with pytest.raises(InputError, match="allow more ripple"):
        tune(*scene(), TuningOptions(0.05, 0.2), PERIOD, white(10.0))


def test_axes_that_nothing_is_asked_of_have_gains_as_well() -> None:
    """A motion in a plane asks the base for nothing about two of its axes, but for rounding."""
    inertia, postures, asked = scene()
    idle = [0, 2]
    factor = np.ones(len(asked.peak))
    factor[idle] = 0.0, 1e-17
    planar = ForceDemand(
        asked.peak * factor, asked.slope * factor, asked.unknown * factor, asked.nominal * factor
    )
    found = tune(inertia, postures, planar, TuningOptions(0.05, 0.2), PERIOD)
    usual = tuned(TuningOptions(0.05, 0.2))
    for law, own in found.laws.items():
        for name, values in own.gains.items():
            assert np.all(values > 0.0), (law, name)
            if name == "gamma":  # of the forces of all axes together
                continue
            busy = np.delete(np.arange(len(values)), idle)
            np.testing.assert_array_equal(values[busy], usual.laws[law].gains[name][busy])


@functools.cache
def heard(sensors: str, navigation: Any = "direct", corner: float = 100.0) -> Noise:
    own = {"navigation_filter.rate_filter_hz": corner, "navigation_filter.joint_bandwidth_hz": 0.0}
    plan = Scenario(
        sensors=sensors, navigation=navigation, case="3", parameters={"controller": own}
    )
    flight = Flight(resolve(plan))
    return listen(
        flight.robot,
        flight.plant_settings,
        flight.controller_settings.filter_settings,
        flight.mission_settings,
        flight.period,
    )


def test_white_noise_has_the_size_it_is_given() -> None:
    found = heard("white_l1")  # 1e-6 and 1e-5 rad/s; J0 = E / 2
    np.testing.assert_allclose(found.rates.std(axis=0), [5e-7] * 3 + [1e-5] * 6, rtol=0.05)
    np.testing.assert_allclose(found.errors.std(axis=0), [5e-6] * 3 + [1e-5] * 6, rtol=0.05)
    assert np.abs(np.corrcoef(found.rates.T) - np.eye(9)).max() < 0.05


@pytest.mark.parametrize("weight", [1.0, 0.3, 0.02])
def test_acceleration_is_that_of_a_low_pass_of_differences(weight: float) -> None:
    """Variance of ``w (v_k - v_k-1) / (1 - (1 - w) z^-1)``: ``2 w^2 / (2 - w)`` of that of v."""
    expected = math.sqrt(2.0 / (2.0 - weight)) * weight / PERIOD
    found = heard("white_l1").acceleration(weight)
    np.testing.assert_allclose(found, np.array([5e-7] * 3 + [1e-5] * 6) * expected, rtol=0.06)


@pytest.mark.parametrize("corner", [20.0, 100.0])
def test_lag_is_that_of_both_low_passes(corner: float) -> None:
    weight = 1.0 - math.exp(-2.0 * math.pi * corner * PERIOD)
    expected = 2.0 * PERIOD * (1.0 - weight) / weight
    assert heard("ideal", "filtered", corner).lag == pytest.approx(expected, rel=1e-6)
    assert not heard("ideal").rates.any()
    assert heard("ideal").lag == 0.0
