"""Ripple against sines of known size, against SciPy, and of the flights it was made for."""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray
from scipy.signal import welch

from space_robot.analysis import Analysis, analyze
from space_robot.analysis.described import robot_of
from space_robot.analysis.figures import ripple
from space_robot.analysis.figures.style import LineStyle
from space_robot.analysis.plot_series import PlotSeries
from space_robot.analysis.ripple import desired_torque, ripple_spectrum
from space_robot.analysis.spectrum import PowerSpectrum
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog

Array = NDArray[np.float64]

PERIOD = 0.0005
SIZES = np.array([0.01, 0.02, 0.03, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
COLUMNS = {"base_torque": slice(0, 3), "torque_1_3": slice(3, 6), "torque_4_6": slice(6, 9)}
DESIRED = simulate(Flight(resolve(FlightPlan(duration=8.0, controller="ctc"))))


def log_with(torque: Array) -> FlightLog:
    """A flight whose torque is what the reference asks for, and ``torque`` (N, 9) beside it."""
    log = DESIRED.rows(0, len(torque))
    log.applied_torque = desired_torque(log, robot_of(log)) + torque
    return log


def seconds(ticks: int) -> Array:
    return np.arange(ticks)[:, np.newaxis] * PERIOD


def flown(h_bar: tuple[float, float, float] = (50.0, 5.0, 0.5), **options: Any) -> dict[str, Any]:
    flight = Flight(resolve(FlightPlan(**options)))
    if flight.controller.law.h_bar.size:
        flight.controller.law.h_bar[:] = np.repeat(h_bar, 3)
    found: dict[str, Any] = analyze(simulate(flight))["ripple"]
    return found


def test_of_a_sine_it_is_its_rms_at_its_frequency() -> None:
    """Whatever slow torque there is beside it, such as a case's disturbances."""
    time = seconds(16_000)
    slow = 0.5 + 0.1 * time + 0.03 * (np.sin(np.pi * time) + np.sin(1.5 * np.pi * time))
    found = analyze(log_with(slow + SIZES * np.sin(2.0 * np.pi * 17.25 * time)))["ripple"]
    rms = SIZES / np.sqrt(2.0)
    assert list(found["axes"].values()) == pytest.approx(rms.tolist(), rel=2e-3)
    for name, axes in COLUMNS.items():
        assert found["rms"][name] == pytest.approx(float(np.mean(rms[axes])), rel=2e-3)
        peak = found["peak"][name]
        assert peak["frequency_hz"] == pytest.approx(17.25, abs=1e-3)
        assert peak["rms"] == pytest.approx(float(np.mean(rms[axes])), rel=2e-3)
        assert peak["rms"] <= found["rms"][name]
        assert found["lasting"][name] == 1.0


def test_the_peak_is_the_greater_of_two() -> None:
    time = seconds(16_000)
    two = np.sin(2.0 * np.pi * 5.0 * time) + 0.5 * np.sin(2.0 * np.pi * 180.1 * time)
    found = analyze(log_with(SIZES * two))["ripple"]
    for name, axes in COLUMNS.items():
        assert found["peak"][name]["frequency_hz"] == pytest.approx(5.0, abs=1e-3)
        rms = float(np.mean(SIZES[axes]) * np.sqrt(0.5 + 0.125))
        assert found["rms"][name] == pytest.approx(rms, rel=1e-3)


def test_a_burst_does_not_last() -> None:
    """A second of eight; of less than two segments nothing is said."""
    time = seconds(16_000)
    burst = SIZES * np.sin(2.0 * np.pi * 5.0 * time) * ((time > 0.5) & (time < 1.5))
    assert set(analyze(log_with(burst))["ripple"]["lasting"].values()) == {0.2}
    short = analyze(log_with(burst[:9_999]))["ripple"]
    assert set(short["lasting"].values()) == {None}


@pytest.mark.parametrize("frequency", [0.1, 0.25, 0.5, 0.75, 1.0])
def test_slow_torque_is_no_ripple(frequency: float) -> None:
    time = seconds(16_000)
    slow = np.sin(2.0 * np.pi * frequency * time) + time**2 / 20.0
    found = ripple_spectrum(log_with(slow * np.ones(9)), robot_of(DESIRED))
    assert np.all(found.rms() < 0.01)


def test_white_noise_has_all_but_its_slow_part() -> None:
    noise = np.random.default_rng(3).normal(size=(16_000, 9)) * SIZES
    found = ripple_spectrum(log_with(noise), robot_of(DESIRED))
    np.testing.assert_allclose(found.rms(), SIZES * np.sqrt(1.0 - 2.0 / 1000.0), rtol=0.02)
    np.testing.assert_allclose(found.rms(500.0), SIZES * np.sqrt(0.5), rtol=0.02)


def test_no_torque_beside_the_desired_one_is_none() -> None:
    found = analyze(log_with(np.zeros((4_000, 9))))["ripple"]
    assert found["above_hz"] == 2.0
    assert set(found["axes"].values()) == {0.0}
    assert set(found["peak"].values()) == {None}


def test_the_side_of_the_desired_quaternion_does_not_matter() -> None:
    log = log_with(seconds(4_000) * np.ones(9))
    before = analyze(log)["ripple"]
    log.reference_base = log.reference_base.copy()
    log.reference_base[:, :4] *= -2.0  # nor does its length
    assert analyze(log)["ripple"] == before


def test_a_moment_says_nothing() -> None:
    report = analyze(log_with(np.zeros((1_999, 9))))
    assert report["ripple"] is None
    assert report["unavailable"]["ripple"] == "1 s of flight are needed"
    assert analyze(log_with(np.zeros((2_000, 9))))["ripple"]


@settings(max_examples=15)
@given(st.lists(st.integers(1, 15_999), max_size=5))
def test_blocks_make_the_whole(cuts: list[int]) -> None:
    analysis, edges = Analysis(), [0, *sorted(cuts), 16_000]
    for start, stop in itertools.pairwise(edges):
        if start < stop:
            analysis.add(DESIRED.rows(start, stop))
    whole, found = analyze(DESIRED)["ripple"], analysis.report()["ripple"]
    for key in ("rms", "axes"):
        assert found[key] == pytest.approx(whole[key], rel=1e-6, abs=1e-12)


@pytest.mark.parametrize("quarters", [4, 5, 9, 12])
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


def test_the_last_rows_of_a_spectrum_count() -> None:
    values = np.zeros((450, 1))
    values[430:] = np.random.default_rng(1).normal(size=(20, 1))
    spectrum = PowerSpectrum(1, PERIOD, 400)
    spectrum.add(values)
    assert np.sum(spectrum.value()[1]) > 0.0
    np.testing.assert_array_equal(spectrum.value()[1], spectrum.value()[1])


def test_the_limit_cycle_of_tde_stc_shows() -> None:
    """At 5 Hz, 3.9e-3 N m an axis beyond CTC's: variation and power above 100 Hz do not show it."""
    twisting, torque = flown(controller="tde_stc"), flown(controller="ctc")
    assert twisting["rms"]["base_torque"] == pytest.approx(3.9e-3, rel=0.05)
    assert torque["rms"]["base_torque"] < 1e-5
    assert twisting["peak"]["base_torque"]["frequency_hz"] == pytest.approx(5.3, abs=0.3)


@pytest.mark.parametrize(
    ("h_bar", "low", "high"),
    [((100.0, 10.0, 0.5), 10, 14), ((200.0, 20.0, 0.5), 20, 28), ((500.0, 20.0, 0.5), 50, 68)],
)
def test_its_frequency_rises_with_h_bar(
    h_bar: tuple[float, float, float], low: float, high: float
) -> None:
    """About 13, 26, and 53 Hz and more; it drifts as the arm moves."""
    peak = flown(h_bar, controller="tde_stc")["peak"]["base_torque"]
    assert low < peak["frequency_hz"] < high


def test_the_figure_has_a_panel_a_group_and_a_line_a_law() -> None:
    """Densities, whose sum is the mean square; a flight that is too short has no line."""
    time = seconds(16_000)
    sine = log_with(0.5 * np.sin(2.0 * np.pi * 20.0 * time) * np.ones(9))
    flights = {"short": PlotSeries.of(DESIRED.rows(0, 500)), "sine": PlotSeries.of(sine)}
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


def test_payload_and_disturbances_are_no_ripple() -> None:
    """Under a smooth law they leave less than a fiftieth of TDE-STC's limit cycle."""
    for case in ("2", "3", "4-2"):
        assert flown(controller="ctc", case=case)["rms"]["base_torque"] < 1e-4
