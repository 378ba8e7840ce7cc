"""Flights on disk: rosbag2 bags in MCAP, written and read without ROS."""

from .reader import read_coverage, read_flight
from .recorder import BagRecorder

__all__ = ["BagRecorder", "read_coverage", "read_flight"]
