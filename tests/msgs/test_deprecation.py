"""Public names are importable from where they were for one version, with a warning."""

from __future__ import annotations

import importlib

import pytest

import space_robot

MOVED = {
    "space_robot_sim": ("Robot", "bias_force", "forward_dynamics", "load_bag", "mass_matrix"),
    "space_robot_control": (
        "Bench",
        "Campaign",
        "FlownCampaign",
        "FlownFlight",
        "Scenario",
        "replay",
    ),
}


@pytest.mark.parametrize(("module", "name"), [(m, n) for m, names in MOVED.items() for n in names])
def test_an_old_place_names_the_new_one(module: str, name: str) -> None:
    with pytest.warns(DeprecationWarning, match=f"{module}.{name} is deprecated: use space_robot"):
        moved = getattr(importlib.import_module(module), name)
    assert moved is getattr(space_robot, name)


@pytest.mark.parametrize("module", [*MOVED, "space_robot"])
def test_other_names_are_not_there(module: str) -> None:
    with pytest.raises(AttributeError, match=f"module '{module}' has no attribute 'Rebot'"):
        _ = importlib.import_module(module).Rebot
