"""The base's actuators as the flight software knows them: the hardware of its own actuators' file.

Numbers given to the plant beside its file (a wheel that is misaligned, a thruster that is weak)
are not in there, so that the controller does not know of them.
"""

from __future__ import annotations

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.files import named_file, node_parameters
from space_robot_msgs_py.config.validation import validate

OWNER = "plant"
"""The node whose parameters the hardware in the actuators' files is."""


def assumed_actuators(name: str, robot: Robot) -> BaseActuatorSettings:
    """Read the hardware of a file of config/actuators, or at a path.

    Args:
        name: of the file, or its path.
        robot: that the controller believes to fly.

    Raises:
        InputError: there is no such file, or it is wrong.
    """
    path = named_file("actuators", name)
    tree = node_parameters(path, OWNER)
    own = {key: tree[key] for key in BaseActuatorSettings.model_fields if key in tree}
    actuators = validate(BaseActuatorSettings, own, str(path))
    actuators.check(robot, name)
    return actuators
