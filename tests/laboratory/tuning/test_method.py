"""The method of ``gains tune`` against what it promises."""

from __future__ import annotations

import functools

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.tuning.demand import ForceDemand, demand
from space_robot.tuning.equal_ripple import LINEAR_SHARE
from space_robot.tuning.held_ripple import law_ripple
from space_robot.tuning.inertia import SAMPLING, inertia_along
from space_robot.tuning.method import Tuned, tune
from space_robot.tuning.noise import Noise
from space_robot.tuning.postures import Posture, postures_along
from space_robot.tuning.spectrum import eigenvalues
from space_robot.tuning.switching_ripple import switching_ripple
from space_robot.tuning.task import TuningOptions, TuningTask, axis_inertia
from space_robot_control.laws import laws
from space_robot_msgs_py.errors import InputError

Array = np.ndarray
PERIOD = 5e-4


@functools.cache
def scene(robot: str = "paper") -> tuple[Array, list[Posture], ForceDemand]:
    """H_S with the least and the largest payload, nominal postures, and what is asked for."""
    flights = [Flight(resolve(FlightPlan(robot=robot, case=case))) for case in ("1", "4-2")]
    first = flights[0]
    inertias = [inertia_along(x.plant.robot, first.mission_settings) for x in flights]
    cases = [x.plant_settings for x in flights]
    postures = postures_along(first.robot, first.mission_settings, SAMPLING)
    return np.concatenate(inertias), postures, demand(first.robot, first.mission_settings, cases)


def tuned(wishes: TuningOptions, robot: str = "paper", lag: float = 0.0) -> Tuned:
    still = np.zeros((100, scene(robot)[0].shape[-1]))
    return tune(*scene(robot), wishes, PERIOD, Noise(still, still, still, lag, PERIOD))


@pytest.mark.parametrize("robot", ["paper", "seven_joint"])
@pytest.mark.parametrize("margin", [0.01, 0.05])
@pytest.mark.parametrize("share", [0.0, 0.2])
def test_the_margin_is_left_with_the_worst_masses(robot: str, margin: float, share: float) -> None:
    found, (inertia, *_) = tuned(TuningOptions(margin, share), robot), scene(robot)
    h_bar = np.asarray(found.gains["tde_stc"]["h_bar"])
    heavy, light = (eigenvalues(factor * inertia, h_bar) for factor in (1.0 + share, 1.0 - share))
    assert heavy.min() == pytest.approx(margin, rel=0.01)  # gains are rounded
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD) if found.corner_hz else 1.0
    assert weight * light.max() < 1.01
    for law in ("tde_smc", "tde_tsmc"):
        np.testing.assert_array_equal(found.gains[law]["h_bar"], h_bar)


def test_poles_are_those_of_the_bandwidth() -> None:
    found = tuned(TuningOptions(0.05, 0.2))
    assert found.bandwidth == pytest.approx(0.05 / found.delay / 4.0)
    for law, bandwidth in (("tde_tsmc", found.bandwidth), ("ctc", found.model_bandwidth)):
        roots = np.roots([1.0, *(float(found.gains[law][name][0]) for name in ("k_d", "k_p"))])
        assert np.abs(roots) == pytest.approx([bandwidth] * 2, rel=0.02)
    assert found.model_bandwidth == pytest.approx(0.05 / PERIOD)
    assert tuned(TuningOptions(0.05, 0.2), lag=0.02).model_bandwidth == pytest.approx(12.5)
    # with the lag of the estimate, a pole at margin / T
    pole = 0.05 / found.delay
    slow = np.roots([1.0 / pole, 1.0, 2.0 * found.bandwidth, found.bandwidth**2])
    pair = slow[np.abs(slow.imag) > 0.0]
    assert -pair[0].real / abs(pair[0]) == pytest.approx(0.7, abs=0.02)


def test_conditions_of_the_laws_hold() -> None:
    found = tuned(TuningOptions(0.05, 0.2))
    stc, smc, layer = (found.gains[law] for law in ("tde_stc", "tde_smc", "ctc_smc"))
    rate = found.bandwidth * found.error
    assert np.all(stc["k_2"] > rate)
    assert np.all(stc["k_1"] ** 2 > 4.0 * stc["k_2"])
    np.testing.assert_allclose(smc["g"], smc["h_bar"] * found.error, rtol=0.02)
    inertia = scene()[0]
    inside = eigenvalues(0.8 * inertia, layer["g"] / layer["delta"])  # s fades with these, 1/s
    assert inside.max() == pytest.approx(found.model_bandwidth, rel=0.02)


def test_a_lag_of_the_navigation_makes_it_slower_not_weaker() -> None:
    quick, slow = (tuned(TuningOptions(0.05, 0.2), lag=lag) for lag in (0.0, 0.02))
    assert slow.delay == pytest.approx(quick.delay + 0.02)
    assert slow.bandwidth < quick.bandwidth / 5.0
    np.testing.assert_array_equal(slow.gains["tde_stc"]["h_bar"], quick.gains["tde_stc"]["h_bar"])


def test_a_bandwidth_beyond_the_estimates_is_refused() -> None:
    assert tuned(TuningOptions(0.05, 0.2, bandwidth=3.0)).gains["ctc"]["k_p"][0] == 9.0
    with pytest.raises(InputError, match=r"at most 13\.\d rad/s.*got 20"):
        tuned(TuningOptions(0.05, 0.2, bandwidth=20.0))


def test_all_laws_of_the_house_get_all_their_gains() -> None:
    found = tuned(TuningOptions(0.05, 0.2))
    assert found.gains.keys() == laws().keys()
    for name, law in laws().items():
        assert found.gains[name].keys() == law.gain_descriptions().keys()


def test_laws_without_h_bar_have_poles_and_inertia_of_the_method() -> None:
    found, inertia = tuned(TuningOptions(0.05, 0.2)), scene()[0]
    free = 1.0 / np.diagonal(np.linalg.inv(inertia), axis1=1, axis2=2)
    d = free.min(axis=0)
    for law in ("pd", "pd_feedforward"):
        gains = found.gains[law]
        np.testing.assert_allclose(gains["k_d"], 2.0 * 100.0 * d, rtol=0.01)
        np.testing.assert_allclose(gains["k_p"], 100.0**2 * d, rtol=0.01)
    dob, h_bar = found.gains["dob"], np.asarray(found.gains["tde_stc"]["h_bar"])
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD)
    np.testing.assert_array_equal(dob["inertia"], h_bar)
    per_tick = dob["bandwidth"] * PERIOD
    np.testing.assert_allclose(per_tick / (1.0 + per_tick), weight, rtol=0.01)
    np.testing.assert_allclose(dob["k_p"], found.bandwidth**2, rtol=0.01)
    adrc = found.gains["adrc"]
    np.testing.assert_array_equal(adrc["inertia"], h_bar)
    np.testing.assert_allclose(3.0 / adrc["omega_o"], PERIOD / weight, rtol=0.01)  # the same lag
    assert np.all(adrc["omega_c"] <= adrc["omega_o"] / 4.0)
    np.testing.assert_allclose(adrc["omega_c"], found.bandwidth, rtol=0.01)


def test_adrc_has_less_inertia_where_its_three_poles_would_be_unstable() -> None:
    """``(s + omega_o)^3 = (1 - lambda) omega_o^3`` has no growing root for lambda below 9."""
    found = tuned(TuningOptions(0.05, 0.2), "seven_joint")
    inertia, h_bar = found.gains["adrc"]["inertia"], found.gains["tde_stc"]["h_bar"]
    assert np.all(np.asarray(inertia) < h_bar)
    largest = eigenvalues(0.8 * scene("seven_joint")[0], np.asarray(inertia)).max()
    assert largest == pytest.approx(5.0, rel=0.01)
    for value, is_stable in ((largest, True), (8.9, True), (9.1, False)):
        roots = np.roots([1.0, 3.0, 3.0, value])
        assert bool(roots.real.max() < 0.0) is is_stable


def test_indi_waits_for_its_estimate_alone() -> None:
    """Its pole is at the smallest eigenvalue of ``H_S'^-1 H_S``, over the lag of the low-pass."""
    found, (inertia, postures, _) = tuned(TuningOptions(0.05, 0.2)), scene()
    nominal = np.tile([posture.inertia for posture in postures], (2, 1, 1))
    small = np.linalg.eigvals(np.linalg.solve(1.2 * inertia, nominal)).real.min()
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD)
    bandwidth = small * weight / PERIOD / 4.0
    assert bandwidth < 100.0
    np.testing.assert_allclose(found.gains["indi"]["k_d"], 2.0 * bandwidth, rtol=0.01)


def test_a_nominal_set_has_no_h_bar_and_is_fast_as_computed_torque() -> None:
    found = tuned(TuningOptions(0.05, 0.2, h_bar="nominal"))
    constant = tuned(TuningOptions(0.05, 0.2))
    for law in ("tde_smc", "tde_tsmc", "tde_stc"):
        assert not found.gains[law]["h_bar"].any()
    assert found.h_bar == "nominal"
    assert found.bandwidth > 5.0 * constant.bandwidth
    assert found.bandwidth <= found.model_bandwidth
    assert found.corner_hz > constant.corner_hz
    for law in ("ctc", "ctc_smc", "pd", "dob", "adrc"):  # they have no part in it
        for name, values in found.gains[law].items():
            np.testing.assert_array_equal(values, constant.gains[law][name])
    # eps: the force that the estimate misses, as acceleration in the worst posture
    inertia, postures, asked = scene()
    gap = found.delay * asked.slope + 0.025 * asked.peak
    accelerations = np.array([np.abs(np.linalg.inv(own)) @ gap for own in inertia])
    share = found.switching
    np.testing.assert_allclose(found.error, share * accelerations.max(axis=0), rtol=1e-6)
    np.testing.assert_allclose(found.gains["tde_smc"]["g"], gap, rtol=0.01)
    # what K_1 switches by in a tick, through H_S, is a tenth of the largest force on one axis
    step = 0.5 * PERIOD * found.gains["tde_stc"]["k_1"] ** 2
    ripple = np.max([np.abs(own.inertia) @ step for own in postures], axis=0)
    assert 0.0 < share < 1.0
    np.testing.assert_allclose((ripple / asked.peak).max(), 0.1, rtol=0.02)


def test_auto_takes_the_nominal_inertia_where_no_diagonal_will_do() -> None:
    """Where a constant one has less than a tenth of the bandwidth of computed torque, or asked."""
    for bandwidth, kind in ((None, "nominal"), (3.0, "constant"), (20.0, "nominal")):
        found = tuned(TuningOptions(0.05, 0.2, bandwidth=bandwidth, h_bar="auto"))
        assert found.constant is not None
        assert found.h_bar == kind
        own = found.constant.bandwidth
        assert (own < 0.1 * found.model_bandwidth) is (bandwidth is None)


def test_more_margin_than_the_payload_leaves_is_refused() -> None:
    with pytest.raises(InputError, match=r"margin must be at most 0\.312 .* got 0\.4"):
        tuned(TuningOptions(0.4, 0.2, h_bar="nominal"))


def test_noise_of_the_nominal_estimate_is_that_of_all_axes_together() -> None:
    inertia, postures, asked = scene()
    wishes = TuningOptions(0.05, 0.2, h_bar="nominal")
    noise = white(1e-6)
    found = tune(inertia, postures, asked, wishes, PERIOD, noise)
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD)
    # white noise through the low-pass of a difference, see test_noise
    one = np.sqrt(2.0 / (2.0 - weight)) * weight / PERIOD * 1e-6
    nominal = np.array([posture.inertia for posture in postures])
    force = one * np.sqrt((nominal**2).sum(axis=2)).max(axis=0)
    assert (force / asked.peak).max() == pytest.approx(0.1, rel=0.05)


def test_every_law_has_the_same_ripple_on_request() -> None:
    """On the limiting axis, with switching terms; and the same W where that is asked for."""
    inertia, postures, asked = scene()
    noise = white(3e-6, 3e-6, 1500)
    wishes = TuningOptions(0.05, 0.2, noise_ripple=0.05)
    found = tune(inertia, postures, asked, wishes, PERIOD, noise)
    task = TuningTask(inertia, postures, asked, wishes, PERIOD, noise)
    weight = 1.0 - np.exp(-2.0 * np.pi * found.corner_hz * PERIOD)
    linear = law_ripple(task, "tde_tsmc", found.gains["tde_tsmc"], weight) / asked.peak
    assert linear.max() == pytest.approx(0.05 * LINEAR_SHARE**0.5, rel=0.05)
    for law in ("tde_smc", "tde_tsmc", "tde_stc"):
        share = switching_ripple(task, law, found.gains[law], weight) / asked.peak
        assert linear.max() < 1.05 * share.max() < 1.05 * 0.0525, law
    largest = switching_ripple(task, "tde_smc", found.gains["tde_smc"], weight) / asked.peak
    assert largest.max() == pytest.approx(0.05, rel=0.05)  # its g had to be made smaller
    for law in ("ctc", "ctc_smc", "dob", "pd", "pd_feedforward"):
        share = law_ripple(task, law, found.gains[law], weight) / asked.peak
        is_at_limit = found.bandwidths[law] > 99.0
        assert share.max() == pytest.approx(0.05, rel=0.05) or (is_at_limit and share.max() < 0.05)
    same = tune(inertia, postures, asked, TuningOptions(0.05, 0.2, bandwidth=2.0), PERIOD)
    for law in ("ctc", "indi", "dob", "tde_tsmc"):
        np.testing.assert_array_equal(same.gains[law]["k_p"], np.full(9, 4.0))
    np.testing.assert_array_equal(same.gains["adrc"]["omega_c"], np.full(9, 2.0))


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


def test_demand_is_what_a_flight_commands() -> None:
    """CTC's torque along case 1 at a high gain is that of inverse dynamics."""
    from space_robot.flight.simulate import simulate

    log = simulate(Flight(resolve(FlightPlan(controller="ctc"))))
    assert log.commanded_torque is not None
    asked = scene()[2]
    flight = Flight(resolve(FlightPlan(controller="ctc")))
    case_1 = demand(flight.robot, flight.mission_settings, [flight.plant_settings])
    peak = np.abs(log.commanded_torque).max(axis=0)
    peak[:3] *= 2.0  # J0 = E / 2
    np.testing.assert_allclose(case_1.peak, peak, rtol=0.02, atol=2e-3)
    assert np.all(asked.peak >= case_1.peak)


def white(rate: float, angle: float = 0.0, ticks: int = 8000) -> Noise:
    """White noise of rates, rad/s (eps: 1/s), and of angles, rad, alike on all axes."""
    rng, shape = np.random.default_rng(1), (ticks, 9)
    rates = rate * rng.normal(size=shape)
    return Noise(rates, angle * rng.normal(size=shape), rates, 0.0, PERIOD)


def test_noise_is_kept_within_the_ripple_allowed() -> None:
    inertia, postures, asked = scene()
    wishes = TuningOptions(0.05, 0.2, ripple=0.1)
    quiet, loud = (
        tune(inertia, postures, asked, wishes, PERIOD, noise=white(x)) for x in (1e-9, 1e-5)
    )
    assert quiet.corner_hz == tuned(wishes).corner_hz
    weight = 1.0 - np.exp(-2.0 * np.pi * loud.corner_hz * PERIOD)
    share = loud.gains["tde_stc"]["h_bar"] * weight / PERIOD * 1e-5 / asked.peak
    assert share.max() == pytest.approx(0.1, rel=0.05)
    assert loud.bandwidth == pytest.approx(0.05 / loud.delay / 4.0, rel=1e-3)


def test_bandwidth_is_also_what_computed_torque_allows() -> None:
    inertia, postures, asked = scene()
    noise = white(1e-9, angle=1e-3)
    found = tune(inertia, postures, asked, TuningOptions(0.05, 0.2), PERIOD, noise)
    own = np.diagonal(inertia, axis1=1, axis2=2).max(axis=0)
    gains = found.gains["ctc"]
    command = gains["k_d"] * noise.rates + gains["k_p"] * noise.errors
    assert (own * command.std(axis=0) / asked.peak).max() == pytest.approx(0.1, rel=0.02)


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
    for law, gains in found.gains.items():
        for name, values in gains.items():
            assert np.all(values > 0.0), (law, name)
            if name == "gamma":  # of the forces of all axes together
                continue
            busy = np.delete(np.arange(len(values)), idle)
            np.testing.assert_array_equal(values[busy], usual.gains[law][name][busy])
