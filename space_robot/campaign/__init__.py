"""Campaigns of many flights, with verdicts."""
