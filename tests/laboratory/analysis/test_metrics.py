"""Metrics of errors and torques against plain loops, SciPy's rotations and spectra; ripple."""

from __future__ import annotations

import itertools
import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from numpy.typing import NDArray
from oracles import rotation_of
from scipy.signal import periodogram, welch
from scipy.spatial.transform import Rotation
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import analyze, tracking_error
from space_robot.analysis.attitude_drift import AttitudeDrift, attitude_drift, controls_base
from space_robot.analysis.described import robot_of
from space_robot.analysis.figures import ripple
from space_robot.analysis.figures.style import LineStyle
from space_robot.analysis.metrics import angles_of, attitude_angles, axis_groups, of_log
from space_robot.analysis.plot_series import PlotSeries
from space_robot.analysis.report_lines import lines
from space_robot.analysis.report_tables import rms_table
from space_robot.analysis.ripple import desired_torque, ripple_spectrum
from space_robot.analysis.spectrum import PowerAbove, PowerSpectrum
from space_robot.analysis.words import notes, remarks
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

Array = NDArray[np.float64]
PERIOD = 0.0005
COLUMNS: dict[int, dict[str, list[int]]] = {
    1: {"base": [0, 1, 2], "1_1": [3]},
    3: {"base": [0, 1, 2], "1_3": [3, 4, 5]},
    4: {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_4": [6]},
    6: {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_6": [6, 7, 8]},
    7: {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_7": [6, 7, 8, 9]},
}
"""Axes of each group by joints."""
TORQUES = {"torque_1_3", "torque_4_6"}


@pytest.mark.parametrize(
    ("branches", "expected"),
    [
        *(((n,), groups) for n, groups in COLUMNS.items()),
        ((3, 2), {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_5": [6, 7]}),
        ((1, 2, 1), {"base": [0, 1, 2], "1": [3], "2_3": [4, 5], "4": [6]}),
    ],
)
def test_groups_cover_every_axis_once_by_branches(branches: tuple[int, ...], expected: Any) -> None:
    n = sum(branches)
    groups = axis_groups(n, branches=branches)
    assert {key: list(range(n + 3))[axes] for key, axes in groups.items()} == expected
    assert "base" not in axis_groups(n, controls_base=False, branches=branches)


def root_mean_square(numbers: list[float]) -> float:
    return math.sqrt(math.fsum(x * x for x in numbers) / len(numbers))


@pytest.mark.parametrize("n", COLUMNS)
def test_every_column_is_that_of_plain_loops(n: int) -> None:
    """Of torques those applied; the largest in size are negative ones."""
    log = random_log(n, 50, n)
    log.joint_positions[17] += 3.0
    log.applied_torque[23] -= 9.0
    report = analyze(log)
    error: list[list[float]] = []
    for k in range(log.ticks):
        turned = rotation_of(log.reference_base[k, :4]).inv() * rotation_of(log.quaternion[k])
        joints = (log.reference_joints[k, 0] - log.joint_positions[k]).tolist()
        error.append([*(-turned.as_quat(canonical=True)[:3]).tolist(), *joints])
    torque = log.applied_torque.tolist()
    close = {"rel": 1e-12, "abs": 1e-15}
    for values, base, prefix in ((error, "attitude", "joints"), (torque, "base_torque", "torque")):
        for group, axes in COLUMNS[n].items():
            name = base if group == "base" else f"{prefix}_{group}"
            columns = [[row[i] for row in values] for i in axes]
            mean = math.fsum(map(root_mean_square, columns)) / len(axes)
            assert report["rms"]["mean_axis"][name] == pytest.approx(mean, **close)
            vector = [math.sqrt(math.fsum(row[i] ** 2 for i in axes)) for row in values]
            expected = root_mean_square(vector) / len(axes)
            assert report["rms"]["eq64"][name] == pytest.approx(expected, **close)
            largest = max(abs(x) for column in columns for x in column)
            assert report["maxima"][name] == pytest.approx(largest, **close)
            if values is torque:
                steps = [math.fsum(abs(b - a) for a, b in itertools.pairwise(c)) for c in columns]
                variation = math.fsum(steps) / len(axes) / (49 * PERIOD)
                chatter = {key: measure[name] for key, measure in report["chatter"].items()}
                assert chatter["total_variation_per_s"] == pytest.approx(variation, **close)
                high, total = powers(log.applied_torque[:, axes])
                share = np.mean(high / total)
                assert chatter["power_above_100_hz"] == pytest.approx(share, rel=1e-9)
    assert report["maxima"]["joints_1_1" if n == 1 else "joints_1_3"] > 2.9
    angles, unit = report["attitude_error_deg"], 2.0 * 180.0 / np.pi  # of small errors
    for kind in ("mean_axis", "eq64"):
        assert angles[kind] == pytest.approx(unit * report["rms"][kind]["attitude"], rel=1e-8)
    assert angles["max"] == pytest.approx(unit * report["maxima"]["attitude"], rel=1e-8)


def powers(values: Array) -> tuple[Array, Array]:
    """Of each column above 100 Hz, and of all frequencies."""
    window = np.hanning(len(values)) + 1e-300
    f, power = periodogram(
        values, fs=1 / PERIOD, window=window, scaling="spectrum", detrend=False, axis=0
    )
    return power[f > 100.0].sum(axis=0), power.sum(axis=0)


@settings(max_examples=30)
@given(st.integers(3, 900), st.integers(0, 2**32 - 1))
def test_power_is_that_of_scipys_periodograms(rows: int, seed: int) -> None:
    """And the last rows count: in a whole segment that ends with them. Of no power it is none."""
    values = np.cumsum(np.random.default_rng(seed).normal(size=(rows, 2)), axis=0)
    metric, segment = PowerAbove(2, PERIOD, segment=200), 200
    metric.add(values[: rows // 3])
    metric.add(values[rows // 3 :])
    starts = list(range(0, rows - segment + 1, segment // 2)) or [0]
    if starts[-1] + segment < rows:
        starts.append(rows - segment)
    high, total = np.sum([powers(values[k : k + segment]) for k in starts], axis=0)
    np.testing.assert_allclose(metric.shares(), high / total, rtol=1e-9)
    for values, frequency in ((np.zeros((rows, 2)), 100.0), (np.ones((rows, 2)), 1000.0)):
        metric = PowerAbove(2, PERIOD, frequency)
        metric.add(values)
        assert metric.shares().tolist() == [0.0, 0.0]


ATTITUDES = arrays(np.float64, (2, 4), elements=st.floats(-1.0, 1.0)).filter(
    lambda q: bool((np.linalg.norm(q, axis=1) > 0.1).all())
)


@given(ATTITUDES)
def test_the_angles_are_those_of_the_rotation_from_the_desired_attitude(attitudes: Array) -> None:
    """By SciPy, at any attitudes: also where the error is 180 degrees but for its sign."""
    desired, true = attitudes / np.linalg.norm(attitudes, axis=1, keepdims=True)
    log = FlightLog.allocate(1, ("j",), Timebase(500_000))
    log.quaternion[:], log.reference_base[:, :4] = true, desired
    turned = rotation_of(desired).inv() * rotation_of(true)
    expected = turned.as_rotvec(degrees=True)
    found, vector = attitude_angles(log)[0], tracking_error(log)[0, :3]
    quaternion = turned.as_quat(canonical=True)
    if quaternion[3] < 1e-12:  # +-180 degrees are the same
        assert np.linalg.norm(found) == pytest.approx(180.0, rel=1e-12)
    else:
        np.testing.assert_allclose(found, -expected, atol=1e-11)
        np.testing.assert_allclose(vector, -quaternion[:3], atol=1e-15)
        if np.linalg.norm(vector) < 0.9:
            np.testing.assert_allclose(angles_of(vector[np.newaxis])[0], -expected, atol=1e-11)


@given(st.integers(0, 2**32 - 1))
def test_drift_is_the_rotation_from_the_start_on_the_bases_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = random_log(2, 6, seed)
    rotations = Rotation.from_quat(rng.normal(size=(6, 4)))
    log.quaternion[:] = rotations.as_quat(scalar_first=True) * rng.choice([-1, 1], size=(6, 1))
    expected = (rotations[0].inv() * rotations).as_rotvec(degrees=True)
    np.testing.assert_allclose(attitude_drift(log), expected, atol=1e-10)
    found = of_log(AttitudeDrift(log), log)
    angle = np.linalg.norm(expected, axis=1)
    assert found == pytest.approx({"max_deg": angle.max(), "end_deg": angle[-1]}, abs=1e-10)
    log.quaternion[:] = [1.0, 0.0, 0.0, 0.0]
    log.quaternion[1] = [1.0, 0.0, 0.5e-12, 0.0]
    small = attitude_drift(log)[:2]
    np.testing.assert_allclose(small, [[0.0] * 3, [0, np.degrees(1e-12), 0]], rtol=1e-12)


def free_log() -> FlightLog:
    """A random flight of which the bag says that nothing turned the base."""
    log = random_log(6, 3000, 0)
    log.flight["base_actuators"] = {"base_actuation": "none"}
    log.applied_torque[:, :3] = 0.0
    assert log.commanded_torque is not None
    log.commanded_torque[:, :3] = 0.0
    return log


def test_a_free_base_has_drift_and_no_error_and_no_torque() -> None:
    log, held = free_log(), free_log()
    del held.flight["base_actuators"]
    log.quaternion[100] = held.quaternion[100] = [0.0, 1.0, 0.0, 0.0]  # J0 is singular there
    assert controls_base(held)
    assert not controls_base(log)
    report, of_held = analyze(log), analyze(held)
    columns = {"joints_1_3", "joints_4_6"} | TORQUES
    for table in (*report["rms"].values(), report["maxima"]):
        assert table.keys() == columns
    for name, measure in report["chatter"].items():
        assert measure.keys() == TORQUES
        assert of_held["chatter"][name].items() > measure.items()
    assert of_held["rms"]["mean_axis"].items() > report["rms"]["mean_axis"].items()
    assert of_held["attitude_drift"] is None
    assert report["estimate_error"]["rms"].keys() == {"1_3", "4_6"}
    assert np.isfinite(list(report["estimate_error"]["max"].values())).all()
    for metric, why in (("attitude", "attitude drifts"), ("base_torque", "no actuators")):
        assert why in report["unavailable"][metric]
    end = f"{report['attitude_drift']['end_deg']:.4g} deg at the end"
    assert any(end in text for text in remarks(report))
    assert any(text.startswith("no attitude: nothing turns the base") for text in notes(report))
    drift = [line for line in lines([report, of_held]) if line.group == "attitude drift"]
    shown = [(line.name, line.unit, line.texts[1]) for line in drift]
    assert shown == [("max", "deg", "-"), ("end", "deg", "-")]
    assert any("drift" in note for note in rms_table(report).notes)


SIZES = np.array([0.01, 0.02, 0.03, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
GROUPS = {"base_torque": slice(0, 3), "torque_1_3": slice(3, 6), "torque_4_6": slice(6, 9)}
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


def test_of_a_sine_it_is_its_rms_at_its_frequency(desired: FlightLog) -> None:
    """Whatever slow torque there is beside it, and on whichever side the quaternion is."""
    slow = 0.5 + 0.1 * TIME + 0.03 * (np.sin(np.pi * TIME) + np.sin(1.5 * np.pi * TIME))
    two = np.sin(2.0 * np.pi * 17.25 * TIME) + 0.5 * np.sin(2.0 * np.pi * 180.1 * TIME)
    log = with_torque(desired, slow + SIZES * two)
    found = analyze(log)["ripple"]
    rms = SIZES * np.sqrt(0.5 + 0.125)
    assert list(found["axes"].values()) == pytest.approx(rms.tolist(), rel=2e-3)
    for name, axes in GROUPS.items():
        assert found["rms"][name] == pytest.approx(float(np.mean(rms[axes])), rel=2e-3)
        peak = found["peak"][name]
        assert peak["frequency_hz"] == pytest.approx(17.25, abs=1e-3)
        assert peak["rms"] == pytest.approx(float(np.mean(SIZES[axes])) / np.sqrt(2.0), rel=2e-3)
        assert found["lasting"][name] == 1.0
    log.reference_base = log.reference_base.copy()
    log.reference_base[:, :4] *= -2.0  # nor does its length matter
    assert analyze(log)["ripple"] == found
    short = analyze(log.rows(0, 1_999))
    assert (short["ripple"], short["unavailable"]["ripple"]) == (None, "1 s of flight are needed")


def test_a_burst_does_not_last(desired: FlightLog) -> None:
    """A second of eight; of less than two segments nothing is said.

    A sine whose second half has a share of the power of the first: a tenth of the mean counts.
    """
    sine = np.sin(2.0 * np.pi * 5.0 * TIME)
    for share, lasting in ((0.05, 0.8), (0.055, 1.0)):
        halves = SIZES * sine * np.where(TIME < 4.0, 1.0, np.sqrt(share))
        found = analyze(with_torque(desired, halves))["ripple"]["lasting"]
        assert found == dict.fromkeys(GROUPS, lasting)
    burst = SIZES * sine * ((TIME > 0.5) & (TIME < 1.5))
    assert set(analyze(with_torque(desired, burst))["ripple"]["lasting"].values()) == {0.2}
    short = analyze(with_torque(desired, burst[:9_999]))["ripple"]
    assert set(short["lasting"].values()) == {None}
    none = analyze(with_torque(desired, np.zeros((2_000, 9))))["ripple"]
    assert (set(none["axes"].values()), set(none["peak"].values())) == ({0.0}, {None})


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
    """At 5 Hz, 3.9e-3 N m an axis beyond CTC's; a payload is no ripple."""
    twisting = Scenario(controller="tde_stc").fly().metrics["ripple"]
    assert twisting["rms"]["base_torque"] == pytest.approx(3.9e-3, rel=0.05)
    assert twisting["peak"]["base_torque"]["frequency_hz"] == pytest.approx(5.3, abs=0.3)
    loaded = Scenario(controller="ctc", case="4-2", duration=8.0).fly().metrics["ripple"]
    assert loaded["rms"]["base_torque"] < 1e-4


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
