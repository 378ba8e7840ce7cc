"""What this machine has for flights, and what to do about what is missing."""

from .checked_item import CheckedItem, Status
from .examination import can_fly, can_fly_with_ros, examine

__all__ = ["CheckedItem", "Status", "can_fly", "can_fly_with_ros", "examine"]
