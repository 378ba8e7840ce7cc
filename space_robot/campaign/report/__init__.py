"""What a campaign's runs say, as tables on a terminal and as one self-contained page."""
