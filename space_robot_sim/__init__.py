"""Simulation: environment, sensors, actuators, faults, and the plant."""
