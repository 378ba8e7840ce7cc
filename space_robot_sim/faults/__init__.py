"""Text form and schedule of faults, and faults of messages between plant and controller.

The faults of a component are declared in its file. Independent of ROS.
"""
