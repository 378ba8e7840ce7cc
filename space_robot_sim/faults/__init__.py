"""Faults as text, when each acts, and those of the messages between plant and controller.

The faults of a sensor, an actuator or the environment stand beside it. Knows no ROS.
"""
