"""Files of config/orbits: what is shipped can be flown; what is wrong is in test_bad_files.py."""

from __future__ import annotations

from pathlib import Path

import pytest
from paths import CONFIG

from space_robot_msgs_py.errors import InputError
from space_robot_sim.environment.orbit_file import orbit_layers, read_orbit
from space_robot_sim.environment.orbit_settings import OrbitSettings

SHIPPED = sorted((CONFIG / "orbits").glob("*.yaml"))


@pytest.mark.parametrize("path", SHIPPED, ids=lambda path: path.stem)
def test_shipped_orbits_stay_above_the_air_that_would_stop_them(path: Path) -> None:
    orbit = read_orbit(path)
    assert orbit.has_orbit == (path.stem != "none")
    if orbit.has_orbit:
        elements = orbit.orbital_elements
        perigee = elements.semi_major_axis * (1.0 - elements.eccentricity) - 6378137.0
        assert perigee > 200e3
    else:
        assert orbit == OrbitSettings()


def test_no_file_is_read_without_an_orbit() -> None:
    """So a resolved scenario flies where there are no files."""
    assert orbit_layers("none") == orbit_layers("given") == []
    assert [path.stem for path in orbit_layers("iss")] == ["iss"]


@pytest.mark.parametrize("section", ["/**", "plant_node", "/plant_node", "/**/plant_node"])
def test_sections_are_those_that_ros_would_apply(section: str, tmp_path: Path) -> None:
    path = tmp_path / "mine.yaml"
    text = "{ros__parameters: {orbital_elements.height: 5.0e5, sunlight: {pressure: 4.56e-6}}}"
    path.write_text(f"{section}: {text}\n")
    orbit = read_orbit(path)
    assert orbit.orbital_elements.height == 5e5
    assert orbit.sunlight.pressure == 4.56e-6


def test_settings_without_an_orbit_are_refused_by_their_key() -> None:
    OrbitSettings().check_orbit("here")
    with pytest.raises(InputError, match=r"^here: magnetism: without an orbit"):
        OrbitSettings.model_validate({"magnetism": {"strength": 3e-5}}).check_orbit("here")
