"""A campaign over orbits, gears and plates is flown, and any of its rows again to the same bits."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
import yaml
from robots import driven_paper

from space_robot.campaign.flown import Campaign, FlownCampaign

pytest.importorskip("pyarrow")
GEARS: dict[str, Any] = {
    "robot.joints[*].drive.stiffness": {"log_uniform": [0.5, 2.0], "relative": True},
    "robot.joints[*].drive.damping": {"uniform": [0.0, 2.0], "relative": True},
    "robot.joints[joint3].drive.rotor_inertia": {"uniform": [0.9, 1.1], "relative": True},
}
WORLD: dict[str, Any] = {
    "scenario.orbit": {"grid": ["iss", "sso_700"]},
    "plant.orbital_elements.height": {"log_uniform": [300e3, 1000e3]},
    "plant.sunlight.beta_angle_deg": {"uniform": [-75, 75]},
    "robot.plates.area": {"normal": 1.0, "sigma": 0.2, "relative": True},
    "robot.plates[*].diffuse": {"uniform": [0.1, 0.3]},
}
RUNS = 10


def fly(folder: Path, vary: dict[str, Any], **scenario: Any) -> FlownCampaign:
    """In this process, eight flights at once where they can be."""
    (folder / "paper.yaml").write_text(yaml.safe_dump(driven_paper()))
    content = {
        "scenario": {"robot": "paper.yaml", "case": "3", "duration": 0.1, **scenario},
        "laws": ["tde_stc"],
        "vary": vary,
        "require": {"pointing": {"metric": "attitude_max", "below": 1e-3, "in": 0.9}},
    }
    (folder / "campaign.yaml").write_text(yaml.safe_dump(content))
    return Campaign.load("campaign.yaml").run(RUNS, 5, folder / "flown", workers=0)


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """An empty working folder."""
    monkeypatch.chdir(tmp_path)
    return tmp_path


def test_orbits_gears_and_plates(here: Path) -> None:
    flown = fly(here, WORLD | GEARS, orbit="iss")
    table = flown.table
    assert len(table) == RUNS
    assert set(table["outcome"]) == {"complete"}
    assert table["digest"].is_unique
    assert table["vary.scenario.orbit"].tolist() == ["iss", "sso_700"] * (RUNS // 2)
    assert table["vary.robot.joints[joint5].drive.stiffness"].between(0.5, 2.0).all()
    for run in (3, 8):
        again = FlownCampaign.open(flown.folder, trust=True).rerun(run)
        assert again.is_same, again.verdict
        assert again.log.geared_names == ("joint2", "joint3", "joint5")
        radius = 6378137.0 + table["vary.plant.orbital_elements.height"][run]
        assert (again.log.orbit_position**2).sum(axis=1) ** 0.5 == pytest.approx(radius, rel=2e-3)


def test_flights_with_and_without_orbit(here: Path) -> None:
    flown = fly(here, GEARS | {"scenario.orbit": {"grid": ["none", "iss"]}})
    assert set(flown.table["outcome"]) == {"complete"}
    for run in (4, 5):
        again = FlownCampaign.open(flown.folder, trust=True).rerun(run)
        assert again.is_same, again.verdict
        assert again.log.orbit_position.shape == (200, 3 if run % 2 else 0)
