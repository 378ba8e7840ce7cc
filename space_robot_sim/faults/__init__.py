"""Faults of the plant, its sensors, its actuators and the links to it. Knows no ROS."""

from .link import Link, Parcel, awaited_stamp
from .plant_faults import PlantFaults

__all__ = ["Link", "Parcel", "PlantFaults", "awaited_stamp"]
