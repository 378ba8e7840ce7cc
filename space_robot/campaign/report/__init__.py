"""Reports of a campaign, as tables on a terminal and as a self-contained HTML page."""
