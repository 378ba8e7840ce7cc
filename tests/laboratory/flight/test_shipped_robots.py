"""Every shipped robot flies its mission under all laws with its own gains."""

from __future__ import annotations

import pytest
from flights import simulated

from space_robot.analysis import analyze
from space_robot.analysis.words import remarks, with_statistic
from space_robot_control.laws import laws
from space_robot_model.robot.find import robot_names

SECONDS = 1.0
"""Of each flight: it starts from rest with joint friction, which all joints have overcome then."""

ATTITUDE = {("canadarm2", "adrc"): 2e-5}
"""Largest RMS where it is not 1e-6: no diagonal inertia is near that of this arm and its base."""


@pytest.mark.parametrize("law", sorted(laws()))
@pytest.mark.parametrize("robot", robot_names())
def test_every_law_flies_it(robot: str, law: str) -> None:
    log = simulated(robot=robot, controller=law, gains="tuned", duration=SECONDS)
    report = analyze(log)
    assert not [text for text in remarks(report) if "beyond" in text], "limits of its file"
    rms = with_statistic(report["metrics"], "rms")
    assert rms.pop("attitude") < ATTITUDE.get((robot, law), 1e-6)
    for name, value in rms.items():
        if name.startswith("joints"):
            assert value < 3e-4, name
    moved = abs(log.joint_positions[-1] - log.joint_positions[0])
    assert moved.max() > 1e-4, "it moves"
