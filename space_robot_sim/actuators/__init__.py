"""Actuators: delay, limits and errors between command and torque."""
