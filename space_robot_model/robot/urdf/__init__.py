"""Strict reading of robots from URDF files, with reports of all defects."""

from .findings import Finding
from .read import UrdfRobot, read_urdf

__all__ = ["Finding", "UrdfRobot", "read_urdf"]
