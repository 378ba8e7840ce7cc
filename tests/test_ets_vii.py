"""The page on ETS-VII has what its commands give: plans, and the worst flights of its campaigns.

Its tables of single flights are compared by test_flown_pages.py.
"""

from __future__ import annotations

import json
import re

import numpy as np
import pytest
from paths import DOCS
from shown import run

from space_robot.campaign.draws import Draws
from space_robot.campaign.study import read_study

PAGE = (DOCS / "explanation/ets_vii.md").read_text("utf-8")
SEED = 7
RUNS = {"ets_vii": 300, "ets_vii_wheels": 150}


def rows(campaign: str) -> list[list[str]]:
    """Cells of the page's table of a campaign."""
    block = re.search(rf"<!-- table {campaign} -->\n(.*?)<!-- end -->", PAGE, re.DOTALL)
    assert block is not None
    lines = [line for line in block[1].splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize(("campaign", "point"), [("ets_vii", 5), ("ets_vii_wheels", 2)])
def test_the_worst_flight_of_a_point_of_a_grid_is_that_of_the_page(
    campaign: str, point: int
) -> None:
    row = rows(campaign)[point]
    *_, middle, spread, largest, worst, within = row
    draws = Draws(read_study(campaign), SEED, RUNS[campaign])
    flown = draws.scenario(int(worst), "ctc").fly()
    if campaign == "ets_vii":
        reached = np.degrees(flown.metrics["attitude_drift.max"])
    else:
        reached = float(np.linalg.norm(flown.log.applied_torque[:, :3], axis=1).max())
    assert float(largest) == pytest.approx(reached, abs=6e-4)
    assert f"`{draws.values(int(worst))['scenario.mission']}`" == row[0]
    low, high = (float(text) for text in spread.split(" to "))
    assert low <= float(middle) <= high <= float(largest)
    assert within == ("50 of 50" if row[0] == "`ets_vii_reactionless`" else "0 of 50")


@pytest.mark.parametrize("name", ["out_and_back", "lift", "reactionless"])
def test_plans_are_those_of_the_page(name: str) -> None:
    plan = json.loads(run("plan", f"ets_vii_{name}", "--robot", "ets_vii", "--json"))
    row = re.search(rf"^\| \[`ets_vii_{name}`\].*\| (\S+) \| (\S+) \|$", PAGE, re.MULTILINE)
    assert row is not None
    first, *_ = plan["segments"]
    assert float(row[1]) == pytest.approx(first["tool_travel_m"], abs=6e-4)
    # what a reactionless path asks for is the rounding of its spline
    rel = 0.5 if name == "reactionless" else 5e-3
    assert float(row[2]) == pytest.approx(first["base_torque"], rel=rel)
