"""Figures of merit against plain loops, SciPy, and hand-made signals with known values."""

from __future__ import annotations

import itertools
import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from random_logs import random_log
from scipy.signal import periodogram, welch
from scipy.spatial.transform import Rotation

from space_robot.analysis import analyze, tracking_error
from space_robot.analysis.metrics import (
    AxisMaximum,
    AxisRms,
    TotalVariation,
    angles_of,
    attitude_angles,
    axis_groups,
    eq64,
    error_columns,
    mean_axis_rms,
    torque_columns,
)
from space_robot.analysis.spectrum import PowerAbove
from space_robot.flight.plan import Flight, FlightPlan, resolve
from space_robot.flight.simulate import simulate
from space_robot_msgs_py.bag.flight_log import FlightLog
from space_robot_msgs_py.samples import Timebase

PERIOD = 0.0005
JOINTS = [1, 3, 6, 7]
COLUMNS: dict[int, dict[str, list[int]]] = {
    1: {"base": [0, 1, 2], "1_1": [3]},
    3: {"base": [0, 1, 2], "1_3": [3, 4, 5]},
    6: {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_6": [6, 7, 8]},
    7: {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_7": [6, 7, 8, 9]},
}
"""Axes of each group, by joints: written out, not computed."""


def total_variation(values: np.ndarray) -> float:
    figure = TotalVariation(values.shape[1])
    figure.add(values)
    return figure.per_second(slice(None), PERIOD)


def power_above(values: np.ndarray, segment: int = 60_000, frequency: float = 100.0) -> np.ndarray:
    figure = PowerAbove(values.shape[1], PERIOD, frequency, segment)
    figure.add(values)
    return figure.shares()


def root_mean_square(numbers: list[float]) -> float:
    return math.sqrt(math.fsum(x * x for x in numbers) / len(numbers))


def eq64_rms(values: np.ndarray) -> float:
    figure = AxisRms(values.shape[1])
    figure.add(values)
    return eq64(figure.value)


def test_the_two_definitions_differ_as_the_paper_has_them() -> None:
    values = np.tile([3.0, 0.0, 4.0], (10, 1))
    assert mean_axis_rms(values) == pytest.approx(7.0 / 3.0)
    assert eq64_rms(values) == pytest.approx(5.0 / 3.0)


@pytest.mark.parametrize("axes", [1, 2, 3, 4, 7])
def test_eq64_divides_by_the_axes_there_are(axes: int) -> None:
    assert eq64_rms(np.full((5, axes), 2.0)) == pytest.approx(2.0 / math.sqrt(axes))


@given(arrays(np.float64, (20, 3), elements=st.floats(-1e3, 1e3)))
def test_definitions_bound_each_other(values: np.ndarray) -> None:
    """Norms: |x|_2 <= |x|_1 <= sqrt(3) |x|_2 of the three axes' RMS."""
    mean, vector = mean_axis_rms(values), eq64_rms(values)
    assert vector <= mean * (1.0 + 1e-12) + 1e-12
    assert mean <= math.sqrt(3.0) * vector * (1.0 + 1e-12) + 1e-12


def rotation(quaternion: np.ndarray) -> Rotation:
    return Rotation.from_quat(quaternion, scalar_first=True)


@pytest.mark.parametrize("n", JOINTS)
def test_every_column_is_that_of_plain_loops(n: int) -> None:
    log = random_log(n, 50, n)
    # largest in size are negative ones, and torques applied are other than commanded
    log.joint_positions[17] += 3.0
    log.applied_torque[23] -= 9.0
    report = analyze(log)
    error: list[list[float]] = []
    for k in range(log.ticks):
        turned = rotation(log.reference_base[k, :4]).inv() * rotation(log.quaternion[k])
        attitude = (-turned.as_quat(canonical=True)[:3]).tolist()
        joints = (log.reference_joints[k, 0] - log.joint_positions[k]).tolist()
        error.append([*attitude, *joints])
    torque = log.applied_torque.tolist()
    for values, base, prefix in ((error, "attitude", "joints"), (torque, "base_torque", "torque")):
        for group, axes in COLUMNS[n].items():
            name = base if group == "base" else f"{prefix}_{group}"
            columns = [[row[i] for row in values] for i in axes]
            rms = [root_mean_square(column) for column in columns]
            close = {"rel": 1e-12, "abs": 1e-15}
            mean = math.fsum(rms) / len(axes)
            assert report["rms"]["mean_axis"][name] == pytest.approx(mean, **close)
            vector = [math.sqrt(math.fsum(row[i] ** 2 for i in axes)) for row in values]
            expected = root_mean_square(vector) / len(axes)
            assert report["rms"]["eq64"][name] == pytest.approx(expected, **close)
            largest = max(abs(x) for column in columns for x in column)
            assert report["maxima"][name] == pytest.approx(largest, **close)
            if values is torque:
                steps = [math.fsum(abs(b - a) for a, b in itertools.pairwise(c)) for c in columns]
                variation = math.fsum(steps) / len(axes) / (49 * PERIOD)
                found = report["chatter"]["total_variation_per_s"][name]
                assert found == pytest.approx(variation, **close)
                _, share = periodogram_share(log.applied_torque[:, axes])
                found = report["chatter"]["power_above_100_hz"][name]
                assert found == pytest.approx(share.mean(), rel=1e-9)
    assert report["maxima"]["joints_1_1" if n == 1 else "joints_1_3"] > 2.9


def periodogram_share(values: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    window = np.hanning(len(values))
    f, power = periodogram(values, fs=1 / PERIOD, window=window, detrend=False, axis=0)
    return f, power[f > 100.0].sum(axis=0) / power.sum(axis=0)


def changed(log: FlightLog, scale: float, order: list[int]) -> FlightLog:
    """Errors and torques of another size, their axes in another order."""
    n = log.axes - 3
    other = log.rows(0, log.ticks)
    other.applied_torque = scale * log.applied_torque[:, order]
    error = tracking_error(log)
    other.quaternion = np.tile([1.0, 0.0, 0.0, 0.0], (log.ticks, 1))
    other.reference_base = np.zeros((log.ticks, 10))
    other.reference_base[:, 0] = 1.0
    other.reference_base[:, 1:4] = scale * error[:, order[:3]]
    other.reference_joints = np.zeros((log.ticks, 3, n))
    other.reference_joints[:, 0] = scale * error[:, order[3:]]
    other.joint_positions = np.zeros((log.ticks, n))
    return other


@given(st.sampled_from(JOINTS), st.integers(0, 99), st.integers(0, 10), st.booleans())
def test_size_sign_and_order_within_a_group(n: int, seed: int, power: int, turned: bool) -> None:
    """A factor comes out as its size (chatter's share not at all), and no order matters."""
    rng = np.random.default_rng(seed)
    log, scale = random_log(n, 40, seed), (-1.0 if turned else 1.0) * 2.0**-power
    order = [int(i) for axes in COLUMNS[n].values() for i in rng.permutation(axes)]
    plain = changed(log, 1.0, list(range(n + 3)))
    one, other = (analyze(x) for x in (plain, changed(log, scale, order)))
    for path in (
        ("rms", "mean_axis"),
        ("rms", "eq64"),
        ("maxima",),
        ("chatter", "total_variation_per_s"),
        ("chatter", "power_above_100_hz"),
    ):
        a, b = one, other
        for key in path:
            a, b = a[key], b[key]
        factor = 1.0 if path[-1] == "power_above_100_hz" else abs(scale)
        assert b == pytest.approx({k: factor * v for k, v in a.items()}, rel=1e-11)


def test_torques_are_those_applied() -> None:
    """Not those commanded."""
    log = random_log(6, 60, 5)
    before = analyze(log)
    assert log.commanded_torque is not None
    log.commanded_torque *= 7.0
    after = analyze(log)
    for key in ("rms", "maxima", "chatter", "saturation", "estimate_error"):
        assert after[key] == before[key]
    log.applied_torque *= 7.0
    for key in ("rms", "maxima", "chatter", "estimate_error"):
        assert analyze(log)[key] != before[key]


def test_total_variation_of_a_ramp_and_of_chatter() -> None:
    time = np.arange(2001) * PERIOD
    ramp = np.column_stack([2.0 * time, -4.0 * time, 0.0 * time])
    assert total_variation(ramp) == pytest.approx(2.0)
    chatter = np.tile([[0.1], [-0.1]], (1000, 1))
    assert total_variation(chatter) == pytest.approx(0.2 / PERIOD)
    assert total_variation(ramp[:1]) == 0.0


def test_power_above_separates_slow_from_fast() -> None:
    time = np.arange(8000) * PERIOD
    slow, fast = np.sin(2 * np.pi * 3.0 * time), np.sin(2 * np.pi * 400.0 * time)
    found = power_above(np.column_stack([slow, fast, 2.0 * slow + fast, 0.0 * slow]))
    assert found[0] < 1e-12
    assert found[1] == pytest.approx(1.0)
    assert found[2] == pytest.approx(0.2, rel=1e-3)
    assert found[3] == 0.0
    assert power_above(fast[:1, np.newaxis]) == 0.0
    assert power_above(fast[:, np.newaxis], frequency=1000.0) == 0.0


@pytest.mark.parametrize("rows", [2, 5, 2500, 5000, 5001])
def test_power_above_is_scipys_periodogram(rows: int) -> None:
    values = np.cumsum(np.random.default_rng(1).normal(size=(rows, 3)), axis=0)
    if rows > 2:
        _, share = periodogram_share(values)
        np.testing.assert_allclose(power_above(values), share, rtol=1e-9)
    else:
        np.testing.assert_array_equal(power_above(values), np.zeros(3))  # Hann's window of 0, 0


@pytest.mark.parametrize("halves", [2, 3, 4, 7])
def test_power_of_long_signals_is_scipys_welch(halves: int) -> None:
    segment = 400
    values = np.cumsum(np.random.default_rng(2).normal(size=(halves * 200, 3)), axis=0)
    f, power = welch(
        values,
        1 / PERIOD,
        window=np.hanning(segment),
        nperseg=segment,
        noverlap=segment // 2,
        detrend=False,
        axis=0,
    )
    share = power[f > 100.0].sum(axis=0) / power.sum(axis=0)
    np.testing.assert_allclose(power_above(values, segment), share, rtol=1e-9)


@given(st.integers(1, 900), st.integers(0, 2**32 - 1), st.integers(1, 400))
def test_power_does_not_depend_on_the_parts(rows: int, seed: int, longest: int) -> None:
    """And the last rows count: in a whole segment that ends with them."""
    rng = np.random.default_rng(seed)
    values = rng.normal(size=(rows, 2))
    figure, start, segment = PowerAbove(2, PERIOD, segment=200), 0, 200
    while start < rows:
        stop = start + int(rng.integers(1, longest + 1))
        figure.add(values[start:stop])
        start = stop
        figure.shares()  # changes nothing
    np.testing.assert_array_equal(figure.shares(), power_above(values, segment))
    starts = list(range(0, rows - segment + 1, segment // 2)) or [0]
    if starts[-1] + segment < rows:
        starts.append(rows - segment)
    parts = [values[k : k + segment] for k in starts]
    high, total = np.zeros(2), np.zeros(2)
    for part in parts:
        f, power = periodogram(
            part,
            fs=1 / PERIOD,
            window=np.hanning(len(part)) + 1e-300,
            scaling="spectrum",
            detrend=False,
            axis=0,
        )
        high, total = high + power[f > 100.0].sum(axis=0), total + power.sum(axis=0)
    if rows > 2:
        np.testing.assert_allclose(figure.shares(), high / total, rtol=1e-9)


def test_a_last_moment_does_not_look_like_chatter() -> None:
    """A short rest of a long flight is no segment of its own: its window would be all leakage."""
    time = np.arange(2005) * PERIOD
    slow = 1.0 + np.sin(2 * np.pi * 3.0 * time)[:, np.newaxis]
    assert power_above(slow, 1000) < 1e-10


@given(arrays(np.float64, (30, 2), elements=st.floats(-1e3, 1e3)), st.integers(0, 30))
def test_largest_is_the_largest_in_size(values: np.ndarray, cut: int) -> None:
    figure = AxisMaximum(2)
    figure.add(values[:cut])
    figure.add(values[cut:])
    assert figure.value.tolist() == [max(abs(x) for x in column) for column in values.T.tolist()]


@pytest.mark.parametrize("n", [*JOINTS, 4])
def test_groups_cover_every_axis_once(n: int) -> None:
    groups = axis_groups(n)
    expected = COLUMNS.get(n, {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_4": [6]})
    assert {key: list(range(n + 3))[axes] for key, axes in groups.items()} == expected
    for columns, names in (
        (error_columns(n + 3), ("attitude", "joints")),
        (torque_columns(n + 3), ("base_torque", "torque")),
    ):
        base, prefix = names
        assert columns == {
            base if key == "base" else f"{prefix}_{key}": axes for key, axes in groups.items()
        }


def test_error_is_measured_on_the_near_side_of_the_two_quaternions() -> None:
    log = FlightLog.allocate(2, ("j",), Timebase(500_000))
    log.quaternion[:] = [1.0, 0.0, 0.0, 0.0], [-1.0, 0.0, 0.0, 0.0]
    angle = 1e-3
    log.reference_base[:] = 0.0
    log.reference_base[:, 0], log.reference_base[:, 1] = math.cos(angle), math.sin(angle)
    log.joint_positions[:], log.reference_joints[:] = 0.25, 1.0
    error = tracking_error(log)
    np.testing.assert_allclose(error[0], [math.sin(angle), 0.0, 0.0, 0.75], atol=1e-15)
    np.testing.assert_array_equal(error[1], error[0])  # Q and -Q are the same attitude


ATTITUDES = arrays(np.float64, (2, 4), elements=st.floats(-1.0, 1.0)).filter(
    lambda q: bool((np.linalg.norm(q, axis=1) > 0.1).all())
)


@given(ATTITUDES)
def test_the_angles_are_those_of_the_rotation_from_the_desired_attitude(
    attitudes: np.ndarray,
) -> None:
    """By SciPy, at any attitudes: also where the error is 180 degrees but for its sign."""
    desired, true = attitudes / np.linalg.norm(attitudes, axis=1, keepdims=True)
    log = FlightLog.allocate(1, ("j",), Timebase(500_000))
    log.quaternion[:], log.reference_base[:, :4] = true, desired
    turned = rotation(desired).inv() * rotation(true)
    expected = turned.as_rotvec(degrees=True)
    found, vector = attitude_angles(log)[0], tracking_error(log)[0, :3]
    quaternion = turned.as_quat(canonical=True)
    close = dict(atol=1e-12 if quaternion[3] < 1e-9 else 1e-11, rtol=0.0)
    if quaternion[3] < 1e-12:  # +-180 degrees are the same
        assert np.linalg.norm(found) == pytest.approx(180.0, rel=1e-12)
    else:
        np.testing.assert_allclose(found, -expected, **close)
        np.testing.assert_allclose(vector, -quaternion[:3], atol=1e-15)
        if np.linalg.norm(vector) < 0.9:
            np.testing.assert_allclose(angles_of(vector[np.newaxis])[0], -expected, **close)


def test_of_a_base_that_is_to_stay_at_the_identity_the_error_has_the_bits_of_the_attitude() -> None:
    log = random_log(6, 100, 3)
    log.quaternion *= np.sign(log.quaternion[:, :1])
    log.reference_base[:, :4] = [1.0, 0.0, 0.0, 0.0]
    np.testing.assert_array_equal(tracking_error(log)[:, :3], -log.quaternion[:, 1:])


def test_the_reports_angles_are_those_of_its_columns() -> None:
    report = analyze(random_log(6, 200, 5))
    angles, unit = report["attitude_error_deg"], 2.0 * 180.0 / np.pi  # of small errors
    for kind in ("mean_axis", "eq64"):
        assert angles[kind] == pytest.approx(unit * report["rms"][kind]["attitude"], rel=1e-8)
    assert angles["max"] == pytest.approx(unit * report["maxima"]["attitude"], rel=1e-8)


def test_report_has_the_documented_keys() -> None:
    report = analyze(simulate(Flight(resolve(FlightPlan(duration=0.1)))))
    six = ["attitude", "joints_1_3", "joints_4_6", "base_torque", "torque_1_3", "torque_4_6"]
    assert list(report["rms"]["mean_axis"]) == list(report["rms"]["eq64"]) == six
    assert list(report["maxima"]) == six
    for chatter in report["chatter"].values():
        assert list(chatter) == six[3:]
    assert (report["controller"], report["case"]) == ("tde_stc", "1")
    assert (report["ticks"], report["duration_s"]) == (200, 0.1)
    assert (report["from_s"], report["to_s"]) == (0.0, 0.1)


@pytest.mark.parametrize(
    ("branches", "expected"),
    [
        ((3, 2), {"base": [0, 1, 2], "1_3": [3, 4, 5], "4_5": [6, 7]}),
        ((1, 2, 1), {"base": [0, 1, 2], "1": [3], "2_3": [4, 5], "4": [6]}),
    ],
)
def test_each_branch_of_several_is_a_group(
    branches: tuple[int, ...], expected: dict[str, list[int]]
) -> None:
    n = sum(branches)
    groups = axis_groups(n, branches=branches)
    assert {key: list(range(n + 3))[axes] for key, axes in groups.items()} == expected
    assert "base" not in axis_groups(n, controls_base=False, branches=branches)
