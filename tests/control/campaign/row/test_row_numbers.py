"""The numbers of a row against the whole log of the same flight, computed in one go."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from space_robot_control import FlownFlight, Scenario
from space_robot_control.analysis import tracking_error
from space_robot_control.campaign.row.bands import Bands
from space_robot_control.campaign.row.columns import Columns
from space_robot_control.campaign.row.measure import Measure, check_requirements
from space_robot_control.campaign.study import Requirement
from space_robot_msgs_py.errors import InputError

REQUIRE = {
    "late": Requirement.model_validate(
        {"metric": "attitude_max", "from_s": 0.6, "below": 1.0, "in": 0.9}
    ),
    "early": Requirement.model_validate(
        {"metric": "torque_4_6_rms", "to_s": 0.25, "below": 1.0, "in": 0.9}
    ),
    "whole": Requirement.model_validate({"metric": "joints_1_3_max", "below": 1.0, "in": 0.9}),
}


@pytest.fixture(scope="module")
def flown() -> FlownFlight:
    return Scenario(case="3", sensors="fine", duration=1.2).fly()


@pytest.fixture(scope="module", params=[2400, 700])
def measured(flown: FlownFlight, request: pytest.FixtureRequest) -> Measure:
    """In one block, and in blocks of 700 ticks."""
    measure = Measure(flown.flight, REQUIRE)
    for start in range(0, 2400, request.param):
        measure.add(flown.log.rows(start, min(start + request.param, 2400)))
    return measure


def test_rms_and_ripple_are_those_of_the_report(flown: FlownFlight, measured: Measure) -> None:
    found, report = measured.metrics(), flown.metrics
    expected = {f"{name}_rms": value for name, value in report["rms"]["mean_axis"].items()}
    for prefix, bands in (("ripple", report["ripple"]), ("fast_ripple", report["ripple"]["fast"])):
        expected |= {f"{prefix}_{name}": value for name, value in bands["rms"].items()}
    assert {name: found[name] for name in expected} == pytest.approx(expected, rel=1e-9)
    assert list(found) == list(Columns.of_log(flown.log).metrics)


def test_maxima_are_norms_of_the_base_and_largest_values_of_joints(
    flown: FlownFlight, measured: Measure
) -> None:
    log, error = flown.log, tracking_error(flown.log)
    found = measured.metrics()
    assert found["attitude_max"] == pytest.approx(np.linalg.norm(error[:, :3], axis=1).max())
    norms = np.linalg.norm(log.applied_torque[:, :3], axis=1)
    assert found["base_torque_max"] == pytest.approx(norms.max())
    assert found["joints_4_6_max"] == np.abs(error[:, 6:]).max()


def test_requirements_are_measured_in_their_windows(flown: FlownFlight, measured: Measure) -> None:
    log, error = flown.log, tracking_error(flown.log)
    found = measured.require()
    late, early = log.time >= 0.6 - 1e-9, log.time <= 0.25 + 1e-9
    assert found["late"] == pytest.approx(np.linalg.norm(error[late, :3], axis=1).max())
    torque = log.applied_torque[early, 6:]
    assert found["early"] == pytest.approx(np.sqrt((torque**2).mean(axis=0)).mean())
    assert found["whole"] == np.abs(error[:, 3:6]).max()


def test_bands_hold_the_largest_of_each_bin(flown: FlownFlight, measured: Measure) -> None:
    norms = np.linalg.norm(tracking_error(flown.log)[:, :3], axis=1)
    expected = norms.reshape(100, 24).max(axis=1)
    np.testing.assert_allclose(measured.bands()["attitude"], expected, rtol=1e-6)


@given(
    st.integers(1, 350).flatmap(
        lambda n: st.tuples(st.just(n), st.lists(st.integers(0, n), max_size=4))
    )
)
def test_bins_do_not_depend_on_blocks(case: tuple[int, list[int]]) -> None:
    ticks, cuts = case
    sizes = np.random.default_rng(ticks).random(ticks)
    bands, edges = Bands(ticks), [0, *sorted(cuts), ticks]
    for start, stop in pairwise(edges):
        bands.add(start, {"x": sizes[start:stop]})
    count = min(100, ticks)
    starts = [k * ticks // count for k in range(count + 1)]
    expected = [sizes[a:b].max() for a, b in pairwise(starts)]
    np.testing.assert_array_equal(bands.result()["x"], np.float32(expected))


@pytest.mark.parametrize(
    ("demand", "said"),
    [
        ({"metric": "attitude_mx"}, "my.yaml: require.p.metric: choose one of attitude_rms"),
        ({"metric": "attitude_max", "from_s": 1.2}, "from_s: must be before the end .*1.2 s"),
    ],
)
def test_what_no_flight_has_cannot_be_required(
    flown: FlownFlight, demand: dict[str, object], said: str
) -> None:
    require = {"p": Requirement.model_validate({**demand, "below": 1.0, "in": 0.9})}
    with pytest.raises(InputError, match=said):
        check_requirements(flown.flight, require, "my.yaml")
