"""Where Earth and Sun are in a flight's orbit, and when the robot is in the shadow."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from moving_logs import moving_log
from orbiting_logs import EARTH_RADIUS, CircularOrbit, orbiting_log
from paths import CONFIG

from space_robot.view.frames import shown_times
from space_robot.view.marks import Mark, marks_of
from space_robot.view.orbit_frames import OrbitFrames, is_in_shadow, shadow_intervals, sun_direction
from space_robot_model.robot import Robot

SECOND = 1_000_000_000


def test_the_frames_are_the_logs_rows(paper_robot: Robot) -> None:
    orbit = CircularOrbit(start=0.3)
    log = orbiting_log(paper_robot, orbit, 50, SECOND)
    log.orbit_velocity[7] = np.nan
    times = shown_times([log], 1.0)
    frames = OrbitFrames.of(log, times)
    assert frames
    rows = np.arange(50)
    rows[7] = 6  # held
    np.testing.assert_array_equal(frames.position, orbit.position(1.0 * rows))
    np.testing.assert_array_equal(frames.velocity, orbit.velocity(1.0 * rows))
    assert frames.sun is not None
    np.testing.assert_allclose(frames.sun, orbit.sun, atol=1e-14)
    assert not frames.is_dark.any()


def test_a_flight_that_is_in_no_orbit(paper_robot: Robot) -> None:
    log = moving_log(paper_robot, 10)
    assert OrbitFrames.of(log, log.time) is None
    assert shadow_intervals(log) == []


@pytest.mark.parametrize("row", [0, 5])
@pytest.mark.parametrize("numbers", [(0.0, 0.0, 0.0), (1e6, 0.0, 0.0), (1e300, 0.0, 0.0)])
def test_a_bag_whose_numbers_are_of_no_orbit(
    paper_robot: Robot, row: int, numbers: tuple[float, ...]
) -> None:
    log = orbiting_log(paper_robot, CircularOrbit(), 10, SECOND)
    log.orbit_position[row] = numbers
    assert OrbitFrames.of(log, log.time) is None
    fallen = orbiting_log(paper_robot, CircularOrbit(), 10, SECOND)
    fallen.orbit_velocity[row] = 0.0
    assert OrbitFrames.of(fallen, fallen.time) is None
    fallen.orbit_velocity[:] = np.nan
    assert OrbitFrames.of(fallen, fallen.time) is None


def test_the_sun_is_unknown_without_sunlight_or_description(paper_robot: Robot) -> None:
    dark = orbiting_log(paper_robot, CircularOrbit(pressure=0.0), 10, SECOND)
    assert sun_direction(dark) is None
    silent = replace(orbiting_log(paper_robot, CircularOrbit(), 10, SECOND), flight={})
    assert sun_direction(silent) is None
    frames = OrbitFrames.of(silent, silent.time)
    assert frames is not None
    assert not frames.is_dark.any()


def test_an_orbits_file_is_read_only_for_a_trusted_bag(paper_robot: Robot, tmp_path: Path) -> None:
    """An older bag may have its name alone."""
    file = tmp_path / "orbit.yaml"
    file.write_text((CONFIG / "orbits" / "iss.yaml").read_text())
    log = orbiting_log(paper_robot, CircularOrbit(), 10, SECOND)
    log.flight = {"robot": "paper", "case": "1", "orbit": str(file)}
    assert sun_direction(log) is not None
    assert sun_direction(replace(log, trusted=False)) is None
    log.flight["orbit"] = "iss"
    assert sun_direction(replace(log, trusted=False)) is not None


@given(
    st.floats(1.0, 7.0),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
    st.tuples(*[st.floats(-1.0, 1.0)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1),
)
def test_in_the_shadow_the_way_to_the_sun_leads_through_the_earth(
    distance: float, place: tuple[float, ...], sun: tuple[float, ...]
) -> None:
    """The way is sampled; where it grazes the Earth it may be either."""
    up, to_sun = (np.array(v) / np.linalg.norm(v) for v in (place, sun))
    position = distance * EARTH_RADIUS * up
    way = position + np.linspace(0.0, 10.0 * EARTH_RADIUS, 20_001)[:, np.newaxis] * to_sun
    nearest = np.linalg.norm(way, axis=1).min() / EARTH_RADIUS
    if abs(nearest - 1.0) > 1e-4:
        assert is_in_shadow(position[np.newaxis], to_sun)[0] == (nearest < 1.0)


def test_an_orbits_shadow_lasts_as_long_as_its_geometry_says(paper_robot: Robot) -> None:
    """Dark is ``cos(beta) cos(u) < -sqrt(1 - (R / r)^2)``, u from noon."""
    orbit = CircularOrbit(beta=0.4, start=0.1)
    period = 2.0 * np.pi / orbit.rate
    log = orbiting_log(paper_robot, orbit, int(period), SECOND)
    half = np.arccos(np.sqrt(1.0 - (EARTH_RADIUS / orbit.radius) ** 2) / np.cos(orbit.beta))
    start, stop = ((np.pi + side * half - orbit.start) / orbit.rate for side in (-1, 1))
    ((dark_from, dark_to),) = shadow_intervals(log)
    assert (dark_from, dark_to) == (np.ceil(start), np.ceil(stop))
    mark = Mark(dark_from, dark_to, "in the Earth's shadow", "shadow")
    assert marks_of(log) == [mark]
    middle = int(0.5 * (start + stop))
    assert shadow_intervals(log.rows(middle, middle + 10)) == [(middle, np.inf)]
    frames = OrbitFrames.of(log, log.time)
    assert frames
    np.testing.assert_array_equal(frames.is_dark, (log.time >= dark_from) & (log.time < dark_to))
    log.orbit_position[middle] = np.nan  # unknown is not dark
    assert len(shadow_intervals(log)) == 2
