"""Strict reading of robots from URDF files, with reports of all defects."""

from .fields import HERE
from .findings import Finding
from .read import UrdfRobot, parse_urdf, read_urdf

__all__ = ["HERE", "Finding", "UrdfRobot", "parse_urdf", "read_urdf"]
