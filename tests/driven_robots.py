"""The paper's robot with gears and plates, as the content of a file."""

from __future__ import annotations

from typing import Any

import yaml
from paths import CONFIG

DRIVE = {"rotor_inertia": 1e-2, "gear_ratio": 100.0, "stiffness": 1e6, "damping": 1e3}
"""With a motor as heavy as the arm, 100 kg m2 through the gear, so that all laws stay stable."""
ENCODERS = {1: "motor", 2: "link", 4: "both"}
"""By number of the link."""
PLATES = [
    {"link": "base", "area": 2.0, "normal": [1.0, 0.3, 0.0], "centre": [0.5, 0.2, 0.1]},
    {"link": "base", "area": 1.5, "normal": [-1.0, 0.0, 0.0], "centre": [-0.5, 0.0, 0.0]},
    {"link": "joint6", "area": 0.3, "normal": [0.0, 0.0, 1.0], "specular": 0.6, "diffuse": 0.1},
]


def driven_paper() -> dict[str, Any]:
    """The paper's robot with three gears and three plates."""
    content: dict[str, Any] = yaml.safe_load((CONFIG / "robots" / "paper.yaml").read_text())
    for number, encoder in ENCODERS.items():
        content["robot"]["links"][number]["drive"] = {**DRIVE, "encoder": encoder}
    content["robot"]["plates"] = PLATES
    return content
