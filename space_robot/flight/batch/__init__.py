"""Eight flights flown together, each with the bits that it has alone."""
