"""Faults of the plant, its sensors, its actuators and the links to it. Knows no ROS."""

from ..plant.faults import PlantFaults
from .link import Link, Parcel, awaited_stamp

__all__ = ["Link", "Parcel", "PlantFaults", "awaited_stamp"]
