"""Rows of a campaign's table: metrics, requirements in windows, bands over time, a digest."""
