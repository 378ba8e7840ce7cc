"""What is flown for docs/explanation/flexible_joints.md."""

from __future__ import annotations

from typing import Any

import yaml
from flown_tables import DOCS, Number, Options, Page, Table, Text

from space_robot.analysis import measure
from space_robot.api.flown_flight import FlownFlight

LAWS = ("ctc", "ctc_smc", "tde_smc", "tde_tsmc", "tde_stc")
TIME_DELAY = LAWS[2:]
STIFFNESS = (1e4, 1e5, 1e6)
"""N m/rad of joints 1 to 3; a fifth of it on joints 4 to 6."""
CORNERS = {1e4: 0.4, 1e5: 1.5, 1e6: 6.0}
"""Hz of the pair's low-pass with encoders on the link, below the limits of `gains check`."""
H_BAR = (50.0, 50.0, 50.0, 2.0, 2.0, 2.0, 0.2, 0.2, 0.2)
"""Table IV's, on the joints 0.4 of it."""
SLOW = {"ctc": {"k_p": [9.0], "k_d": [6.0]}}
"""Computed torque with poles at 3 rad/s."""
DURATION = 20.0
PAGE_PATH = "explanation/flexible_joints.md"


def geared(stiffness: float, encoder: str) -> dict[str, Any]:
    """Return the paper's robot with a gear in every joint."""
    content: dict[str, Any] = yaml.safe_load(
        (DOCS.parent / "config/robots/paper.yaml").read_text("utf-8")
    )
    for number, link in enumerate(content["robot"]["links"]):
        share = 1.0 if number < 3 else 0.2
        inertia, spring = 2.0 * share, stiffness * share
        link["drive"] = {
            "rotor_inertia": inertia / 1e4,
            "gear_ratio": 100.0,
            "stiffness": spring,
            "damping": float(f"{0.02 * (spring * inertia) ** 0.5:.4g}"),
            "encoder": encoder,
        }
    return content


def largest_error(flown: FlownFlight) -> float | None:
    """Return the largest error of a joint, rad; None if the flight diverged."""
    if flown.ending.outcome != "complete":
        return None
    return max(measure(flown.log, ("joints_1_3.max", "joints_4_6.max")).values())


def _flight(law: str, stiffness: float, encoder: str, **options: Any) -> Options:
    return {
        "controller": law,
        "duration": DURATION,
        "plant_robot": geared(stiffness, encoder),
        **options,
    }


def _with_limits(law: str, stiffness: float, encoder: str) -> Options:
    if law == "ctc":
        return _flight(law, stiffness, encoder, gains=SLOW)
    changed: dict[str, Any] = {f"{law}.h_bar": list(H_BAR)}
    if encoder == "link":
        changed = {"acceleration_filter_hz": CORNERS[stiffness]}
    return _flight(law, stiffness, encoder, parameters={"controller": changed})


def _row(encoder: str, stiffness: float, flights: list[Options]) -> list[str | Number | Text]:
    errors = [Number(options, largest_error, ".1e") for options in flights]
    return [encoder, f"{stiffness:.0e}".replace("e+0", "e"), *errors]


CASES = [(encoder, stiffness) for encoder in ("motor", "link") for stiffness in STIFFNESS]
PAGE = Page(
    "flexible_joints",
    PAGE_PATH,
    (
        Table(
            "shipped",
            ("encoder", "K", "CTC", "CTC-SMC", "TDE-SMC", "TDE-TSMC", "TDE-STC"),
            [_row(e, k, [_flight(law, k, e) for law in LAWS]) for e, k in CASES],
        ),
        Table(
            "limited",
            ("encoder", "K", "CTC, 3 rad/s", "TDE-SMC", "TDE-TSMC", "TDE-STC"),
            [
                _row(e, k, [_with_limits(law, k, e) for law in ("ctc", *TIME_DELAY)])
                for e, k in CASES
            ],
        ),
    ),
)
