"""Sensors: measurements of the true state with errors and faults."""
