"""Put tables and figures of the flown campaigns into law_league.md: `python docs/law_league.py`.

The page names the folders: what stands between ``<!-- begin DIR -->`` and ``<!-- end -->`` is what
`space-robot campaign report DIR --markdown` writes of that folder, without what was flown. The
figure goes beside the page, named like the folder. Folders that are not there are left out.
"""

from __future__ import annotations

import re
from pathlib import Path

from space_robot_control.analysis.figures.style import save_figure
from space_robot_control.analysis.tables import as_markdown
from space_robot_control.campaign.flown import FlownCampaign
from space_robot_control.campaign.report.console import tables
from space_robot_control.campaign.report.figures import summary_figure
from space_robot_control.campaign.report.findings import Findings
from space_robot_control.campaign.report.subject import subject_of

PAGE = Path(__file__).with_name("law_league.md")
BLOCK = re.compile(r"(<!-- begin (\S+) -->\n).*?(<!-- end -->)", re.DOTALL)
OF_WHAT_WAS_FLOWN = 1
"""Tables before those of the laws."""


def block(folder: str) -> str:
    """Return the tables of a campaign, and draw its figure."""
    findings = Findings(subject_of(FlownCampaign.open(folder)))
    text = as_markdown("", [*tables(findings)][OF_WHAT_WAS_FLOWN:]).removeprefix("# \n\n")
    name = f"law_{Path(folder).name}"
    if figure := summary_figure(findings):
        save_figure(figure, PAGE.with_name(name))
        PAGE.with_name(f"{name}.svg").unlink()
        text = f"![{name}]({name}.png)\n\n{text}"
    subject = findings.subject
    runs = f"{subject.table['run'].nunique()} runs, seed {subject.seed}"
    return f"{runs}.\n\n" + re.sub(r"^## ", "### ", text, flags=re.MULTILINE)


def renewed(found: re.Match[str]) -> str:
    """Return a block of the page with the tables of its folder; as it is if that is not there."""
    return f"{found[1]}{block(found[2])}{found[3]}" if Path(found[2]).is_dir() else found[0]


if __name__ == "__main__":
    PAGE.write_text(BLOCK.sub(renewed, PAGE.read_text("utf-8")), "utf-8")
