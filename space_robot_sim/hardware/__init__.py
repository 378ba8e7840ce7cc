"""Data sheets of hardware: what the simulation builds it from, and what flight software assumes of it."""
