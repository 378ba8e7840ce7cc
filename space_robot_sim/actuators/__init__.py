"""Actuators turn commands into torques: delay, limits."""
