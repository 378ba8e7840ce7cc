"""Sensors measure the true state, and their measurements go wrong."""
