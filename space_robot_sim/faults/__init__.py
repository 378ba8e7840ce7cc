"""Faults as text, and when each of them acts. Knows no ROS."""
