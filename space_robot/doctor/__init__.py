"""What this machine has for flights, and what to do about what is missing."""

from .checks import CheckedItem, can_fly, can_fly_with_ros, examine

__all__ = ["CheckedItem", "can_fly", "can_fly_with_ros", "examine"]
