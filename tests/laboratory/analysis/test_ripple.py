"""Ripple against sines of known size, against SciPy, and of the flights it was made for."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from scipy.signal import welch

from space_robot import Scenario
from space_robot.analysis import analyze
from space_robot.analysis.described import robot_of
from space_robot.analysis.figures import ripple
from space_robot.analysis.figures.style import LineStyle
from space_robot.analysis.plot_series import PlotSeries
from space_robot.analysis.ripple import desired_torque, ripple_spectrum
from space_robot.analysis.spectrum import PowerSpectrum
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]
PERIOD = 0.0005
SIZES = np.array([0.01, 0.02, 0.03, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
COLUMNS = {"base_torque": slice(0, 3), "torque_1_3": slice(3, 6), "torque_4_6": slice(6, 9)}
TIME = np.arange(16_000)[:, np.newaxis] * PERIOD


@pytest.fixture(scope="module")
def desired() -> FlightLog:
    """A flight whose torque is what the reference asks for."""
    log = Scenario(duration=8.0, controller="ctc").fly().log
    log.applied_torque = desired_torque(log, robot_of(log))
    return log


def with_torque(desired: FlightLog, torque: Array) -> FlightLog:
    """The same flight with ``torque`` (N, 9) beside what the reference asks for."""
    log = desired.rows(0, len(torque))
    log.applied_torque = desired.applied_torque[: len(torque)] + torque
    return log


def ripple_of(**options: Any) -> Any:
    return Scenario(**options).fly().metrics["ripple"]


def test_of_a_sine_it_is_its_rms_at_its_frequency(desired: FlightLog) -> None:
    """Whatever slow torque there is beside it, and on whichever side the quaternion is."""
    slow = 0.5 + 0.1 * TIME + 0.03 * (np.sin(np.pi * TIME) + np.sin(1.5 * np.pi * TIME))
    two = np.sin(2.0 * np.pi * 17.25 * TIME) + 0.5 * np.sin(2.0 * np.pi * 180.1 * TIME)
    log = with_torque(desired, slow + SIZES * two)
    found = analyze(log)["ripple"]
    rms = SIZES * np.sqrt(0.5 + 0.125)
    assert list(found["axes"].values()) == pytest.approx(rms.tolist(), rel=2e-3)
    for name, axes in COLUMNS.items():
        assert found["rms"][name] == pytest.approx(float(np.mean(rms[axes])), rel=2e-3)
        peak = found["peak"][name]
        assert peak["frequency_hz"] == pytest.approx(17.25, abs=1e-3)
        assert peak["rms"] == pytest.approx(float(np.mean(SIZES[axes])) / np.sqrt(2.0), rel=2e-3)
        assert found["lasting"][name] == 1.0
    log.reference_base = log.reference_base.copy()
    log.reference_base[:, :4] *= -2.0  # nor does its length matter
    assert analyze(log)["ripple"] == found


def test_a_burst_does_not_last(desired: FlightLog) -> None:
    """A second of eight; of less than two segments nothing is said.

    A sine whose second half has a share of the power of the first: a tenth of the mean counts.
    """
    sine = np.sin(2.0 * np.pi * 5.0 * TIME)
    for share, lasting in ((0.04, 0.8), (0.07, 1.0)):
        halves = SIZES * sine * np.where(TIME < 4.0, 1.0, np.sqrt(share))
        found = analyze(with_torque(desired, halves))["ripple"]["lasting"]
        assert found == dict.fromkeys(COLUMNS, lasting)
    burst = SIZES * sine * ((TIME > 0.5) & (TIME < 1.5))
    assert set(analyze(with_torque(desired, burst))["ripple"]["lasting"].values()) == {0.2}
    short = analyze(with_torque(desired, burst[:9_999]))["ripple"]
    assert set(short["lasting"].values()) == {None}


def test_slow_torque_is_none_and_white_noise_has_all_but_its_slow_part(desired: FlightLog) -> None:
    robot = robot_of(desired)
    for frequency in (0.1, 0.25, 0.5, 0.75, 1.0):
        slow = np.sin(2.0 * np.pi * frequency * TIME) + TIME**2 / 20.0
        found = ripple_spectrum(with_torque(desired, slow * np.ones(9)), robot)
        assert np.all(found.rms() < 0.01), frequency
    noise = np.random.default_rng(3).normal(size=(16_000, 9)) * SIZES
    found = ripple_spectrum(with_torque(desired, noise), robot)
    np.testing.assert_allclose(found.rms(), SIZES * np.sqrt(1.0 - 2.0 / 1000.0), rtol=0.02)
    np.testing.assert_allclose(found.rms(500.0), SIZES * np.sqrt(0.5), rtol=0.02)


def test_a_moment_says_nothing_and_no_torque_beside_the_desired_is_none(desired: FlightLog) -> None:
    report = analyze(with_torque(desired, np.zeros((1_999, 9))))
    assert report["ripple"] is None
    assert report["unavailable"]["ripple"] == "1 s of flight are needed"
    found = analyze(with_torque(desired, np.zeros((2_000, 9))))["ripple"]
    assert found["above_hz"] == 2.0
    assert set(found["axes"].values()) == {0.0}
    assert set(found["peak"].values()) == {None}


@pytest.mark.parametrize("quarters", [4, 9])
def test_the_spectrum_is_scipys_welch(quarters: int) -> None:
    segment = 400
    values = np.cumsum(np.random.default_rng(2).normal(size=(quarters * 100, 3)), axis=0)
    f, density = welch(
        values, 1.0 / PERIOD, nperseg=segment, noverlap=3 * segment // 4, detrend="linear", axis=0
    )
    spectrum = PowerSpectrum(3, PERIOD, segment)
    spectrum.add(values[:170])
    spectrum.add(values[170:])
    frequency, mean_square = spectrum.value()
    np.testing.assert_allclose(frequency, f)
    np.testing.assert_allclose(mean_square, density * f[1], rtol=1e-9, atol=1e-12)
    spectrum.add(np.zeros((30, 3)))  # the last rows count, once
    spectrum.add(1e9 * np.random.default_rng(1).normal(size=(20, 3)))
    assert np.all(spectrum.value()[1].sum(axis=0) > 1e10)


def test_the_limit_cycle_of_tde_stc_shows_and_smooth_flights_have_none() -> None:
    """At 5 Hz, 3.9e-3 N m an axis beyond CTC's, and faster with h_bar; a payload is no ripple."""
    twisting, torque = (ripple_of(controller=law) for law in ("tde_stc", "ctc"))
    assert twisting["rms"]["base_torque"] == pytest.approx(3.9e-3, rel=0.05)
    assert twisting["peak"]["base_torque"]["frequency_hz"] == pytest.approx(5.3, abs=0.3)
    assert torque["rms"]["base_torque"] < 1e-5
    assert ripple_of(controller="ctc", case="4-2")["rms"]["base_torque"] < 1e-4
    stiff = {"controller": {"tde_stc.h_bar": np.repeat([500.0, 20.0, 0.5], 3).tolist()}}
    fast = ripple_of(controller="tde_stc", parameters=stiff)["peak"]["base_torque"]
    assert 50.0 < fast["frequency_hz"] < 68.0


def test_the_figure_has_a_panel_a_group_and_a_line_a_law(desired: FlightLog) -> None:
    """Densities, whose sum is the mean square; a flight that is too short has no line."""
    sine = with_torque(desired, 0.5 * np.sin(2.0 * np.pi * 20.0 * TIME) * np.ones(9))
    flights = {"short": PlotSeries.of(desired.rows(0, 500)), "sine": PlotSeries.of(sine)}
    figure = ripple(flights)
    assert len(figure.axes) == 3
    for axes in figure.axes:
        (line,) = axes.get_lines()
        assert line.get_color() == LineStyle.of(1).colour
        frequency, density = np.asarray(line.get_data())
        assert frequency[0] == 2.0
        assert np.nansum(density) * (frequency[1] - frequency[0]) == pytest.approx(0.125, rel=1e-3)
        assert frequency[np.nanargmax(density)] == 20.0
    assert not ripple({"short": flights["short"]}).axes
