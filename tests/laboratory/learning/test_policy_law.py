"""The policy of examples/learning as a law: it acts in a flight as in its environment."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from paths import ROOT

import space_robot as sr
from space_robot_control.laws import find_law

PROGRAM = ROOT / "examples/learning/train_reach.py"


def test_a_policy_moves_the_arm_in_a_flight_as_in_its_environment(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    random, sizes = np.random.default_rng(3), (18, 8, 9)
    pairs = list(zip(sizes[1:], sizes[:-1], strict=True))
    layers = [random.normal(size=shape).astype(np.float32) for shape in pairs]
    weights: dict[str, Any] = {f"w{k}": layer for k, layer in enumerate(layers)}
    weights |= {f"b{k}": 0.1 * layer[:, 0] for k, layer in enumerate(layers)}
    np.savez(tmp_path / "policy.npz", **weights)
    monkeypatch.setenv("POLICY", str(tmp_path / "policy.npz"))
    law: Any = find_law(f"{PROGRAM}:PolicyLaw")
    own = law.force.__globals__
    env = sr.make("reach", **{**own["TASK"], "start_spread": 0.0})
    observation, _ = env.reset(seed=1)
    start = env.task.begin.truth.joint_positions.copy()
    target = start + observation[3:9]
    steps = 10
    for _ in range(steps):
        seen = np.clip(observation / own["SEEN"], -5.0, 5.0).astype(np.float32)
        hidden = np.tanh(layers[0] @ seen + weights["b0"])
        action = np.clip(layers[1] @ hidden + weights["b1"], -1.0, 1.0)
        observation = env.step(action)[0]
    scenario = sr.Scenario(
        controller=law,
        gains={"limit": [1.0] * 9},
        mission={"start": {"joints_deg": np.degrees(target).tolist()}, "segments": [{"hold": 1.0}]},
        parameters={"plant": {"initial_joints_deg": np.degrees(start).tolist()}},
        duration=(steps * own["TICKS"] + 1) * 5e-4,
    )
    with pytest.warns(UserWarning, match="from where the mission begins"):
        log = scenario.fly().log
    flown = log.joint_positions[-1]
    assert np.abs(flown - start).max() > 1e-3
    np.testing.assert_allclose(flown, target - observation[3:9], atol=1e-9)
