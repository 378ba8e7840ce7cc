"""A folder for a new robot: itself, a mission, gains for all laws, each flown once."""

from .folder import check_replaceable
from .make import NewRobot, make_robot
from .texts import robot_texts

__all__ = ["NewRobot", "check_replaceable", "make_robot", "robot_texts"]
