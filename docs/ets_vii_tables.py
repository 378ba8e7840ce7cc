"""Put tables and figure of flown campaigns into explanation/ets_vii.md.

Run `python docs/ets_vii_tables.py`. The table of each of `CAMPAIGNS` has a row for each point of
the grid of that campaign, flown into `campaigns`. Folders that are not there are left out.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from numpy.typing import NDArray

from space_robot import FlownCampaign
from space_robot.analysis.figures.style import COLOURS, GREY, house_style, page, save_figure

sys.path.append(str(Path(__file__).parent / "flown"))
from marks import markdown, put

if TYPE_CHECKING:
    from pandas import DataFrame

PAGE = Path(__file__).parent / "explanation/ets_vii.md"
PICTURE = Path(__file__).with_name("ets_vii")
CAMPAIGNS = ("ets_vii", "ets_vii_wheels")
MISSION, GRADIENT = "vary.scenario.mission", "vary.plant.gravity.gradient"
DRIFT = "attitude_drift"
DURATIONS = {"out_and_back": 84.6, "lift": 55.2, "reactionless": 55.2}
"""Of the missions, s."""
BAND_DEG = 0.1
"""That the campaign requires."""


class Metric(NamedTuple):
    """A metric of the table, and its unit on the page."""

    column: str
    requirement: str
    heading: str
    factor: float


METRICS = {
    "drift": Metric("metric.attitude_drift.max", "band", "°", 180.0 / np.pi),
    "torque": Metric("metric.base_torque.max", "torque", "N m", 1.0),
}


class Point(NamedTuple):
    """A row of a table."""

    cells: tuple[str, ...]
    """Of the grid."""
    values: NDArray[np.float64]
    """(N,) in the unit of the page."""
    worst_run: int

    def row(self, campaign: FlownCampaign, requirement: str) -> list[str]:
        """Return the row of the table."""
        bound = campaign.study.require[requirement]
        low, middle, high = np.quantile(self.values, [0.05, 0.5, 0.95], method="inverted_cdf")
        numbers = (f"{middle:.3f}", f"{low:.3f} to {high:.3f}", f"{self.values.max():.3f}")
        within = np.count_nonzero(self.values < bound.bound * _metric(campaign).factor)
        return [*self.cells, *numbers, str(self.worst_run), f"{within} of {len(self.values)}"]


def points(campaign: FlownCampaign) -> Iterator[Point]:
    """Yield the points of the grid in the order of the campaign's file."""
    metric, keys = _metric(campaign), _keys(campaign.table)
    for values, rows in campaign.table.groupby(keys, sort=False):
        sizes = rows[metric.column].to_numpy(float) * metric.factor
        cells = tuple(_cell(value) for value in values)
        yield Point(cells, sizes, int(rows["run"].iloc[int(np.argmax(sizes))]))


def table(campaign: FlownCampaign) -> str:
    """Return the table of a campaign in Markdown."""
    metric = _metric(campaign)
    grid = ["mission", "gravity gradient"][: len(_keys(campaign.table))]
    bound = campaign.study.require[metric.requirement].bound * metric.factor
    unit = metric.heading
    space = "" if unit == "°" else " "
    head = (
        *grid,
        f"median, {unit}",
        f"5 to 95 %, {unit}",
        f"largest, {unit}",
        "its run",
        f"below {bound:.1f}{space}{unit}",
    )
    return markdown(head, [point.row(campaign, metric.requirement) for point in points(campaign)])


@house_style()
def figure(flights: DataFrame) -> Figure:
    """Draw the base's drift over time: median and 5 to 95 % of the draws, a panel a mission."""
    drawn = page(62.0)
    panels = drawn.subplots(1, len(DURATIONS), sharey=True)
    for axes, (name, duration) in zip(panels, DURATIONS.items(), strict=True):
        of_mission = flights[flights[MISSION] == f"ets_vii_{name}"]
        for colour, gradient in ((COLOURS[2], "false"), (COLOURS[6], "true")):
            rows = of_mission[of_mission[GRADIENT].map(_text) == gradient]
            _draw(axes, np.degrees(np.stack(rows[f"band.{DRIFT}"].to_list())), duration, colour)
        axes.axhline(BAND_DEG, color=GREY, linewidth=0.8, linestyle=":")
        axes.set(title=name.replace("_", " "), xlabel="time (s)", xlim=(0.0, duration))
    panels[0].set(ylabel="drift (deg)", ylim=(0.0, None))
    labels = ("without gravity gradient", "with gravity gradient")
    drawn.legend(panels[0].get_lines()[:2], labels, loc="outside upper left", ncols=2)
    return drawn


def _draw(axes: Axes, drifts: NDArray[np.float64], duration: float, colour: str) -> None:
    edges = np.linspace(0.0, duration, drifts.shape[1] + 1)
    time = 0.5 * (edges[1:] + edges[:-1])
    low, middle, high = np.quantile(drifts, [0.05, 0.5, 0.95], axis=0)
    axes.plot(time, middle, color=colour)
    axes.fill_between(time, low, high, color=colour, alpha=0.25, linewidth=0.0)


def _metric(campaign: FlownCampaign) -> Metric:
    return METRICS["drift" if "band" in campaign.study.require else "torque"]


def _keys(flights: DataFrame) -> list[str]:
    return [key for key in (MISSION, GRADIENT) if key in flights]


def _text(value: object) -> str:
    return str(value).lower()


def _cell(value: object) -> str:
    text = _text(value)
    names = {"true": "yes", "false": "no"}
    return names.get(text, f"`{text}`")


def renewed(text: str, name: str) -> str:
    """Return the page with the table of a campaign; as it is if that is not flown."""
    folder = Path("campaigns", name)
    if not folder.is_dir():
        return text
    campaign = FlownCampaign.open(folder)
    if DRIFT in " ".join(map(str, campaign.table)):
        save_figure(figure(campaign.table), PICTURE)
        PICTURE.with_suffix(".svg").unlink()
    return put(text, name, table(campaign))


if __name__ == "__main__":
    for name in CAMPAIGNS:
        PAGE.write_text(renewed(PAGE.read_text("utf-8"), name), "utf-8")
