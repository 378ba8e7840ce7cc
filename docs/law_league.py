"""Put tables and figures of the flown campaigns into law_league.md.

`python docs/law_league.py` does so. The page names the folders: between ``<!-- begin DIR -->`` and
``<!-- end -->`` are the tables in which `space-robot campaign report DIR --markdown` compares laws.
The figure goes beside the page, named like the folder. ``<!-- begin DIR medians -->`` has one
table, a metric a row, ``<!-- begin DIR ranks -->`` one with medians and ranks. Folders that are not
there are left out.
"""

from __future__ import annotations

import re
from pathlib import Path

from space_robot.analysis.figures.style import save_figure
from space_robot.campaign.flown import FlownCampaign
from space_robot.campaign.report.documents import sections
from space_robot.campaign.report.figures import summary_figure
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.report.tables import choice_tables, league_tables
from space_robot.console.tables import Column, Group, Table, as_markdown

HERE = Path(__file__).parent
PAGE = HERE / "law_league.md"
BLOCK = re.compile(
    r"(<!-- begin (\S+)( medians| ranks)?( with figure)? -->\n).*?(<!-- end -->)", re.DOTALL
)
COMPARING = {"rank", "to fly"}
"""Columns of tables that compare laws."""
LEFT_OUT = re.compile("joints 1-3|, largest")
"""Metrics that only the table with ranks has, or none: RMS decides, and the wrist."""


def block(findings: Findings) -> str:
    """Return the tables that compare laws, and draw the campaign's figure."""
    comparing = [
        table
        for section in sections(findings)
        for table in section.tables
        if COMPARING & {column.name for column in table.columns}
        and not LEFT_OUT.search(table.title)
    ]
    text = as_markdown("", comparing).removeprefix("# \n\n")
    return figure(findings) + re.sub(r"^## ", "### ", text, flags=re.MULTILINE)


def figure(findings: Findings) -> str:
    """Draw the figure of a campaign, and return the line that shows it; empty if it has none."""
    drawn = summary_figure(findings)
    if drawn is None:
        return ""
    name = f"law_{findings.folder.name}"
    save_figure(drawn, HERE / name)
    HERE.joinpath(f"{name}.svg").unlink()
    return f"![{name}]({name}.png)\n\n"


def medians(findings: Findings) -> str:
    """Return the medians of all metrics as one table; the campaign has no grid."""
    found = [table for table in choice_tables(findings) if not LEFT_OUT.search(table.title)]
    rows = [[table.title, *row] for table in found for row in table.groups[0].rows]
    columns = [Column("median", is_label=True), *found[0].columns]
    return as_markdown("", [Table("", columns, [Group(rows)])]).lstrip("# \n")


def ranks(findings: Findings) -> str:
    """Return medians and ranks as one table, a metric a row; the campaign has no grid."""
    rows: dict[str, dict[str, str]] = {}
    for table in league_tables(findings):
        if "largest" not in table.title:
            of_laws = {row[0]: f"{row[2]} ({row[1]})" for row in table.groups[0].rows}
            rows[table.title] = of_laws
    laws = list(findings.names.values())
    columns = [Column("median (rank)", is_label=True), *(Column(law) for law in laws)]
    cells = [[title, *(own[law] for law in laws)] for title, own in rows.items()]
    return as_markdown("", [Table("", columns, [Group(cells)])]).lstrip("# \n")


def renewed(found: re.Match[str]) -> str:
    """Return a block of the page with the tables of its folder; as it is if that is not there."""
    if not Path(found[2]).is_dir():
        return found[0]
    findings = Findings.of(FlownCampaign.open(found[2]))
    runs = f"{findings.table['run'].nunique()} runs, seed {findings.seed}.\n\n"
    picture = figure(findings) if found[4] else ""
    of_kind = {" medians": medians, " ranks": ranks}.get(found[3], block)
    text = of_kind(findings)
    return f"{found[1]}{runs}{picture}{text}{found[5]}"


if __name__ == "__main__":
    PAGE.write_text(BLOCK.sub(renewed, PAGE.read_text("utf-8")), "utf-8")
