"""Text form and schedule of faults, and faults of messages between plant and controller.

The faults of a sensor, an actuator or the environment stand beside it. Independent of ROS.
"""
