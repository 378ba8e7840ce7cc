"""Put tables and figures of the flown campaigns into law_league.md: `python docs/law_league.py`.

The page names the folders: what stands between ``<!-- begin DIR -->`` and ``<!-- end -->`` is what
`space-robot campaign report DIR --markdown` writes of that folder, without what was flown. The
figure goes beside the page, named like the folder. ``<!-- begin DIR medians -->`` has one table, a
metric a row. Folders that are not there are left out.
"""

from __future__ import annotations

import re
from pathlib import Path

from space_robot.analysis.figures.style import save_figure
from space_robot.campaign.flown import FlownCampaign
from space_robot.campaign.report.console import tables
from space_robot.campaign.report.figures import summary_figure
from space_robot.campaign.report.findings import Findings
from space_robot.campaign.report.league_tables import choice_tables
from space_robot.campaign.report.subject import subject_of
from space_robot.console.tables import Column, Group, Table, as_markdown

PAGE = Path(__file__).with_name("law_league.md")
BLOCK = re.compile(r"(<!-- begin (\S+)( medians)? -->\n).*?(<!-- end -->)", re.DOTALL)
OF_WHAT_WAS_FLOWN = 1
"""Tables before those of the laws."""


def block(findings: Findings) -> str:
    """Return the tables of a campaign, and draw its figure."""
    text = as_markdown("", [*tables(findings)][OF_WHAT_WAS_FLOWN:]).removeprefix("# \n\n")
    name = f"law_{findings.subject.folder.name}"
    if figure := summary_figure(findings):
        save_figure(figure, PAGE.with_name(name))
        PAGE.with_name(f"{name}.svg").unlink()
        text = f"![{name}]({name}.png)\n\n{text}"
    return re.sub(r"^## ", "### ", text, flags=re.MULTILINE)


def medians(findings: Findings) -> str:
    """Return the medians of all metrics as one table; the campaign has no grid."""
    found = choice_tables(findings)
    rows = [[table.title, *row] for table in found for row in table.groups[0].rows]
    columns = [Column("median", is_label=True), *found[0].columns]
    return as_markdown("", [Table("", columns, [Group(rows)])]).lstrip("# \n")


def renewed(found: re.Match[str]) -> str:
    """Return a block of the page with the tables of its folder; as it is if that is not there."""
    if not Path(found[2]).is_dir():
        return found[0]
    findings = Findings(subject_of(FlownCampaign.open(found[2])))
    subject = findings.subject
    runs = f"{subject.table['run'].nunique()} runs, seed {subject.seed}.\n\n"
    return f"{found[1]}{runs}{medians(findings) if found[3] else block(findings)}{found[4]}"


if __name__ == "__main__":
    PAGE.write_text(BLOCK.sub(renewed, PAGE.read_text("utf-8")), "utf-8")
