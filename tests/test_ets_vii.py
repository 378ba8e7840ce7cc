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
OUT_AND_BACK, LIFT, REACTIONLESS = (
    f"ets_vii_{n}" for n in ("out_and_back", "lift", "reactionless")
)


def rows(campaign: str) -> list[list[str]]:
    """Cells of the page's table of a campaign."""
    block = re.search(rf"<!-- begin campaigns/{campaign} -->\n(.*?)<!-- end -->", PAGE, re.DOTALL)
    assert block is not None
    lines = [line for line in block[1].splitlines() if line.startswith("| `")]
    return [[cell.strip() for cell in line.strip("|").split("|")] for line in lines]


@pytest.mark.parametrize(
    ("campaign", "point"), [("ets_vii", 3), ("ets_vii", 4), ("ets_vii", 5), ("ets_vii_wheels", 2)]
)
def test_the_worst_flight_of_a_point_of_a_grid_is_that_of_the_page(
    campaign: str, point: int
) -> None:
    row = rows(campaign)[point]
    *_, middle, spread, largest, worst, within = row
    draws = Draws(read_study(campaign), SEED, RUNS[campaign], check=False)
    flown = draws.scenario(int(worst), "ctc").fly()
    if campaign == "ets_vii":
        reached = flown.report()["attitude_drift"]["max_deg"]
    else:
        reached = float(np.linalg.norm(flown.log.applied_torque[:, :3], axis=1).max())
    assert float(largest) == pytest.approx(reached, abs=6e-4)
    assert f"`{draws.values(int(worst))['scenario.mission']}`" == row[0]
    low, high = (float(text) for text in spread.split(" to "))
    assert low <= float(middle) <= high <= float(largest)
    is_reactionless = row[0] == f"`{REACTIONLESS}`"
    assert within == ("50 of 50" if is_reactionless else "0 of 50")


@pytest.mark.parametrize("mission", [OUT_AND_BACK, LIFT, REACTIONLESS])
def test_plans_are_those_of_the_page(mission: str) -> None:
    plan = json.loads(run("plan", mission, "--robot", "ets_vii", "--json"))
    row = re.search(rf"^\| \[`{mission}`\].*\| (\S+) \| (\S+) \|$", PAGE, re.MULTILINE)
    assert row is not None
    first, *_, last = plan["segments"]
    assert float(row[1]) == pytest.approx(first["tool_travel_m"], abs=6e-4)
    torque = first["base_torque"]
    # what a reactionless path asks for is the rounding of its spline
    assert float(row[2]) == pytest.approx(torque, rel=0.5 if mission == REACTIONLESS else 5e-3)
    if mission == REACTIONLESS:
        shown = re.search(r"nothing of the way is left, at (.*?) \(`goal_deg`", PAGE)
        assert shown is not None
        degrees = [float(text) for text in re.findall(r"-?\d+\.\d", shown[1])]
        np.testing.assert_allclose(degrees, first["goal_deg"], atol=0.06)
        away = np.abs(np.array(last["goal_deg"]) - [0.0, -30.0, 60.0, 0.0, 60.0, 0.0])
        assert away.max() == pytest.approx(0.4, abs=0.05)
