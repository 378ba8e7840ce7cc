"""Flights as a graph of nodes: start, monitor, inject faults, stop."""
