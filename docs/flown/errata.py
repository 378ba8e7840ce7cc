"""What is flown for docs/explanation/errata.md."""

from __future__ import annotations

from typing import Any

import yaml
from flown_tables import DOCS, Cell, Number, Options, Page, Table

GROUPS = {"base_torque": "base", "torque_1_3": "joints 1-3", "torque_4_6": "joints 4-6"}
SETS = (
    ("ctc", "tuned"),
    ("tde_tsmc", "tuned"),
    ("tde_stc", "printed"),
    ("tde_tsmc", "printed"),
    ("tde_smc", "printed"),
)


def _with_misprint(**of_joint_4: float) -> Options:
    """Of the plant and of the flight software, with Table III's link 3."""
    content = _config("robots/paper.yaml")
    links = content["robot"]["links"]
    links[2]["com"][1] = -0.108
    links[3] |= of_joint_4
    gains = _config("gains/paper/printed/tde_stc.yaml")["controller_node"]["ros__parameters"]
    return {"robot": content, "mission": "paper", "gains": gains}


def _config(path: str) -> dict[str, Any]:
    content: dict[str, Any] = yaml.safe_load((DOCS.parent / "config" / path).read_text("utf-8"))
    return content


def _torques(group: str, printed: str) -> list[Cell]:
    flights: list[Options] = [{}, _with_misprint(), _with_misprint(d=0.216)]
    ours, *others = (Number({**o, "friction": False}, f"{group}.rms", ".4f") for o in flights)
    return [GROUPS[group].replace("base", "base torque"), ours, printed, *others]


def _variations(group: str) -> list[Cell]:
    flights: list[Options] = [{"controller": law, "gains": gains} for law, gains in SETS]
    return [GROUPS[group], *(Number(own, f"{group}.variation", "#.3g") for own in flights)]


PAGE = Page(
    "errata",
    "explanation/errata.md",
    (
        Table(
            "misprint",
            (
                "case 1, N m",
                "-1.08",
                "Table V",
                "-0.108 (`misprint.yaml`)",
                "-0.108 and $d_4$ = 0.216 (`short_link.yaml`)",
            ),
            [_torques(*row) for row in zip(GROUPS, ("0.7988", "0.9285", "0.0450"), strict=True)],
        ),
        Table("variations", ("", *map(", ".join, SETS)), [_variations(group) for group in GROUPS]),
    ),
)
