"""Folder of a new robot: its description, a mission, and gains of all laws, each flown once."""

from .folder import check_replaceable
from .make import NewRobot, make_robot
from .texts import robot_texts

__all__ = ["NewRobot", "check_replaceable", "make_robot", "robot_texts"]
