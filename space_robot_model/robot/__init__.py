"""The robot as data."""

from .robot import Robot

__all__ = ["Robot"]
