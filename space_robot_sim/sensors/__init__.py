"""Sensors measure the true state, each with errors of its own; and they fail."""
