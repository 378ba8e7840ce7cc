"""Reports of a campaign, as tables on a terminal and as one self-contained page."""
