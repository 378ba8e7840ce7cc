"""Strict reading of robots from URDF files, with reports of all defects."""

from .read import UrdfRobot, parse_urdf, read_urdf
from .xml import HERE, Finding

__all__ = ["HERE", "Finding", "UrdfRobot", "parse_urdf", "read_urdf"]
