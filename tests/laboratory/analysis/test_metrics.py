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
from oracles import rotation_of
from scipy.signal import periodogram, welch
from scipy.spatial.transform import Rotation
from strategies import random_log

from space_robot import Scenario
from space_robot.analysis import Window, analyze, describe, measure, tracking_error
from space_robot.analysis.analysed_log import AnalysedLog
from space_robot.analysis.described import flown_robot
from space_robot.analysis.errors import (
    attitude_angles,
    attitude_drift,
    axis_groups,
    controls_base,
    rotation_vectors,
    unit_quaternions,
)
from space_robot.analysis.figures import ripple
from space_robot.analysis.figures.overlay import FlightCurves
from space_robot.analysis.figures.style import LineStyle
from space_robot.analysis.measure import all_metrics, label, names
from space_robot.analysis.report_tables import comparison_table, rms_table
from space_robot.analysis.torques import desired_torque, hann, ripple_spectrum, segment_spectra
from space_robot.analysis.words import notes, remarks, with_statistic
from space_robot_model.elementary.matrices import Array
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.errors import InputError
from space_robot_msgs_py.samples import Timebase

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
    metrics = measure(log)
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
            assert metrics[f"{name}.rms"] == pytest.approx(mean, **close)
            vector = [math.sqrt(math.fsum(row[i] ** 2 for i in axes)) for row in values]
            expected = root_mean_square(vector) / len(axes)
            assert metrics[f"{name}.rms_eq64"] == pytest.approx(expected, **close)
            sizes = vector if group == "base" else [abs(x) for c in columns for x in c]
            assert metrics[f"{name}.max"] == pytest.approx(max(sizes), **close)
            if values is torque:
                steps = [math.fsum(abs(b - a) for a, b in itertools.pairwise(c)) for c in columns]
                variation = math.fsum(steps) / len(axes) / (49 * PERIOD)
                assert metrics[f"{name}.variation"] == pytest.approx(variation, **close)
                high, total = powers(log.applied_torque[:, axes])
                share = np.mean(high / total)
                assert metrics[f"{name}.chatter"] == pytest.approx(share, rel=1e-9)
    assert metrics["joints_1_1.max" if n == 1 else "joints_1_3.max"] > 2.9
    unit = 2.0 * 180.0 / np.pi  # of small errors
    for kind in ("rms", "rms_eq64", "max"):
        expected = unit * metrics[f"attitude.{kind}"]
        assert metrics[f"attitude_angle.{kind}"] == pytest.approx(expected, rel=1e-8)


def test_names_are_known_beforehand_and_each_is_declared_once() -> None:
    log = random_log(6, 3000, 1)
    log.latency_s = np.full(3000, 1e-4)
    known, found = list(names(AnalysedLog(log))), measure(log)
    assert len(set(known)) == len(known)
    assert set(found) <= set(known)
    for name in found:
        matching = describe(name)
        assert matching.text, name
        assert "{" not in matching.unit, name
    patterns = [name for _, name, _ in all_metrics()]
    assert len(set(patterns)) == len(patterns)
    assert (describe("joints_prismatic.max").unit, describe("joints_1_3.max").unit) == ("m", "rad")
    assert describe("force_prismatic.variation").unit == "N/s"
    assert label("joints_1_3.rms") == "joints 1-3, RMS"
    assert label("base_torque.ripple_fast") == "base torque, ripple above 25 Hz"


def test_of_a_window_and_of_some_only_these_are_measured() -> None:
    """Both ends count; what counts from the start of a flight still does."""
    log = Scenario(duration=1.5).fly().log
    wanted = ["base_torque.max", "joints_1_3.rms", "base_drift.end", "torque_1_3.variation"]
    found = measure(log, wanted, Window(0.5, 1.0))
    assert list(found) == wanted
    part = measure(log.rows(1000, 2001))
    for name in (wanted[0], wanted[1], wanted[3]):
        assert found[name] == pytest.approx(part[name], rel=1e-12)
    away = float(np.linalg.norm(log.base_position[2000] - log.base_position[0]))
    assert found["base_drift.end"] == pytest.approx(away, rel=1e-12)
    assert measure(log, ["base_torque.max"], Window(9.0)) == {}
    with pytest.raises(InputError, match="did you mean"):
        measure(log, ["base_torque.mx"])


def powers(values: Array) -> tuple[Array, Array]:
    """Of each column above 100 Hz, and of all frequencies."""
    window = np.hanning(len(values)) + 1e-300
    f, power = periodogram(
        values, fs=1 / PERIOD, window=window, scaling="spectrum", detrend=False, axis=0
    )
    return power[f > 100.0].sum(axis=0), power.sum(axis=0)


@settings(max_examples=30)
@given(st.integers(3, 900), st.integers(0, 2**32 - 1), st.booleans(), st.sampled_from([99, 200]))
def test_spectra_are_those_of_scipys_welch(
    rows: int, seed: int, is_detrended: bool, length: int
) -> None:
    values = np.cumsum(np.random.default_rng(seed).normal(size=(rows, 2)), axis=0)
    window = hann(length := min(length, rows), length)
    step = max(1, length // 4)
    spectra = segment_spectra(lambda a, b: values[a:b], rows, window, step, is_detrended)
    found = np.mean(list(spectra), axis=0) / window.sum() ** 2
    _, expected = welch(
        values,
        1.0 / PERIOD,
        window,
        noverlap=length - step,
        detrend="linear" if is_detrended else False,
        scaling="spectrum",
        axis=0,
    )
    np.testing.assert_allclose(found, expected, rtol=1e-9, atol=1e-12 * expected.max())


def test_of_a_long_flight_no_part_is_left_out_of_its_chatter() -> None:
    log = random_log(1, 100_001, 0)
    log.applied_torque[:] = 0.0
    assert measure(log, ["base_torque.chatter"]) == {"base_torque.chatter": 0.0}
    for row in (3_000, 50_000, 97_000):
        log.applied_torque[row] = 1.0
        assert measure(log, ["base_torque.chatter"])["base_torque.chatter"] > 0.8
        log.applied_torque[row] = 0.0


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
            (turned_by,) = np.degrees(rotation_vectors(unit_quaternions(vector[np.newaxis])))
            np.testing.assert_allclose(turned_by, -expected, atol=1e-11)


@given(st.integers(0, 2**32 - 1))
def test_drift_is_the_rotation_from_the_start_on_the_bases_axes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    log = random_log(2, 6, seed)
    rotations = Rotation.from_quat(rng.normal(size=(6, 4)))
    log.quaternion[:] = rotations.as_quat(scalar_first=True) * rng.choice([-1, 1], size=(6, 1))
    expected = (rotations[0].inv() * rotations).as_rotvec()
    np.testing.assert_allclose(attitude_drift(log), expected, atol=1e-12)
    log.flight["base_actuators"] = {"base_actuation": "none"}
    angle = np.linalg.norm(expected, axis=1)
    wanted = {"attitude_drift.max": angle.max(), "attitude_drift.end": angle[-1]}
    assert measure(log, list(wanted)) == pytest.approx(wanted, abs=1e-12)
    log.quaternion[:] = [1.0, 0.0, 0.0, 0.0]
    log.quaternion[1] = [1.0, 0.0, 0.5e-12, 0.0]
    small = attitude_drift(log)[:2]
    np.testing.assert_allclose(small, [[0.0] * 3, [0, 1e-12, 0]], rtol=1e-12)


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
    free, fixed = report["metrics"], of_held["metrics"]
    assert with_statistic(free, "rms_eq64").keys() == columns
    for statistic in ("variation", "chatter", "rms_eq64"):
        assert with_statistic(fixed, statistic).items() > with_statistic(free, statistic).items()
    assert with_statistic(free, "chatter").keys() == TORQUES
    assert not [name for name in fixed if name.startswith("attitude_drift")]
    estimate = {name for name in free if name.startswith("estimate_error")}
    assert estimate == {f"estimate_error_{g}.{s}" for g in ("1_3", "4_6") for s in ("rms", "max")}
    assert np.isfinite([free[name] for name in estimate]).all()
    for metric, why in (("attitude", "attitude drifts"), ("base_torque", "no actuators")):
        assert why in report["unavailable"][metric]
    end = f"{np.degrees(free['attitude_drift.end']):.4g} deg at the end"
    assert any(end in text for text in remarks(report))
    assert any(text.startswith("no attitude: nothing turns the base") for text in notes(report))
    table = comparison_table({"free": report, "held": of_held})
    (drift,) = (group.rows for group in table.groups if group.name == "attitude drift")
    assert [(row[0], row[2]) for row in drift] == [
        (f"attitude_drift.{statistic} (rad)", "-") for statistic in ("rms", "max", "end")
    ]
    brief = rms_table(analyze(log, in_brief=True))
    assert brief == rms_table(report)
    assert any("drift" in note for note in brief.notes)


SIZES = np.array([0.01, 0.02, 0.03, 0.1, 0.2, 0.3, 1.0, 2.0, 3.0])
GROUPS = {"base_torque": slice(0, 3), "torque_1_3": slice(3, 6), "torque_4_6": slice(6, 9)}
TIME = np.arange(16_000)[:, np.newaxis] * PERIOD


@pytest.fixture(scope="module")
def desired() -> FlightLog:
    """A flight whose torque is what the reference asks for."""
    log = Scenario(duration=8.0, controller="ctc").fly().log
    log.applied_torque = desired_torque(log, flown_robot(log))
    return log


def with_torque(desired: FlightLog, torque: Array) -> FlightLog:
    """The same flight with ``torque`` (N, 9) beside what the reference asks for."""
    log = desired.rows(0, len(torque))
    log.applied_torque = desired.applied_torque[: len(torque)] + torque
    return log


def ripple_of(log: FlightLog) -> dict[str, float]:
    return {name: value for name, value in measure(log).items() if ".ripple" in name}


def lasting_of(log: FlightLog) -> dict[str, float]:
    return with_statistic(measure(log), "ripple_lasting")


def test_of_a_sine_it_is_its_rms_at_its_frequency(desired: FlightLog) -> None:
    """Whatever slow torque there is beside it, and on whichever side the quaternion is."""
    slow = 0.5 + 0.1 * TIME + 0.03 * (np.sin(np.pi * TIME) + np.sin(1.5 * np.pi * TIME))
    two = np.sin(2.0 * np.pi * 17.25 * TIME) + 0.5 * np.sin(2.0 * np.pi * 180.1 * TIME)
    log = with_torque(desired, slow + SIZES * two)
    found = ripple_of(log)
    rms = SIZES * np.sqrt(0.5 + 0.125)
    axis_names = AnalysedLog(log).axis_names
    each = [found[f"{name}.ripple_axis"] for name in axis_names]
    assert each == pytest.approx(rms.tolist(), rel=2e-3)
    for name, axes in GROUPS.items():
        assert found[f"{name}.ripple"] == pytest.approx(float(np.mean(rms[axes])), rel=2e-3)
        assert found[f"{name}.ripple_peak_hz"] == pytest.approx(17.25, abs=1e-3)
        peak = float(np.mean(SIZES[axes])) / np.sqrt(2.0)
        assert found[f"{name}.ripple_peak"] == pytest.approx(peak, rel=2e-3)
        assert found[f"{name}.ripple_lasting"] == 1.0
    log.reference_base = log.reference_base.copy()
    log.reference_base[:, :4] *= -2.0  # nor does its length matter
    assert ripple_of(log) == found
    short = analyze(log.rows(0, 1_999))
    assert not with_statistic(short["metrics"], "ripple")
    assert short["unavailable"]["ripple"] == "1 s of flight are needed"


def test_a_burst_does_not_last(desired: FlightLog) -> None:
    """A second of eight; of less than two segments nothing is said.

    A sine whose second half has a share of the power of the first: a tenth of the mean counts.
    """
    sine = np.sin(2.0 * np.pi * 5.0 * TIME)
    for share, lasting in ((0.05, 0.8), (0.055, 1.0)):
        halves = SIZES * sine * np.where(TIME < 4.0, 1.0, np.sqrt(share))
        found = lasting_of(with_torque(desired, halves))
        assert found == dict.fromkeys(GROUPS, lasting)
    burst = SIZES * sine * ((TIME > 0.5) & (TIME < 1.5))
    assert set(lasting_of(with_torque(desired, burst)).values()) == {0.2}
    assert not lasting_of(with_torque(desired, burst[:9_999]))
    none = ripple_of(with_torque(desired, np.zeros((2_000, 9))))
    assert set(none.values()) == {0.0}
    assert not with_statistic(none, "ripple_peak")


def test_slow_torque_is_none_and_white_noise_has_all_but_its_slow_part(desired: FlightLog) -> None:
    for frequency in (0.1, 0.25, 0.5, 0.75, 1.0):
        slow = np.sin(2.0 * np.pi * frequency * TIME) + TIME**2 / 20.0
        found = ripple_spectrum(AnalysedLog(with_torque(desired, slow * np.ones(9))))
        assert np.all(found.rms() < 0.01), frequency
    noise = np.random.default_rng(3).normal(size=(16_000, 9)) * SIZES
    found = ripple_spectrum(AnalysedLog(with_torque(desired, noise)))
    np.testing.assert_allclose(found.rms(), SIZES * np.sqrt(1.0 - 2.0 / 1000.0), rtol=0.02)
    np.testing.assert_allclose(found.rms(500.0), SIZES * np.sqrt(0.5), rtol=0.02)


def test_the_limit_cycle_of_tde_stc_shows_and_smooth_flights_have_none() -> None:
    """At 5 Hz, 3.9e-3 N m an axis beyond CTC's; a payload is no ripple."""
    twisting = Scenario(controller="tde_stc").fly().metrics
    assert twisting["base_torque.ripple"] == pytest.approx(3.9e-3, rel=0.05)
    assert twisting["base_torque.ripple_peak_hz"] == pytest.approx(5.3, abs=0.3)
    loaded = Scenario(controller="ctc", case="4-2", duration=8.0).fly().metrics
    assert loaded["base_torque.ripple"] < 1e-4


def test_the_figure_has_a_panel_a_group_and_a_line_a_law(desired: FlightLog) -> None:
    """Densities, whose sum is the mean square; a flight that is too short has no line."""
    sine = with_torque(desired, 0.5 * np.sin(2.0 * np.pi * 20.0 * TIME) * np.ones(9))
    flights = {"short": FlightCurves.of(desired.rows(0, 500)), "sine": FlightCurves.of(sine)}
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
