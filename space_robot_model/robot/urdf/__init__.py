"""Robots from URDF files: read strictly, every defect named."""

from .findings import Finding
from .read import UrdfRobot, read_urdf

__all__ = ["Finding", "UrdfRobot", "read_urdf"]
