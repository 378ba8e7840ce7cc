"""Base actuators assumed by the flight software, from its own actuators' file.

Parameters of the plant alone (a misaligned wheel, a weak thruster)
are not included, so the controller does not know them.
"""

from __future__ import annotations

from space_robot_model.hardware.base_actuators import BaseActuatorSettings
from space_robot_model.robot import Robot
from space_robot_msgs_py.config.files import named_file, node_parameters
from space_robot_msgs_py.config.validation import validate

OWNER = "plant"
"""Node whose parameters are in the actuators' files."""


def assumed_actuators(name: str, robot: Robot) -> BaseActuatorSettings:
    """Read the hardware of a file of config/actuators, or at a path.

    Args:
        name: of the file, or its path.
        robot: assumed by the controller.

    Raises:
        InputError: there is no such file, or it is wrong.
    """
    path = named_file("actuators", name)
    tree = node_parameters(path, OWNER)
    own = {key: tree[key] for key in BaseActuatorSettings.model_fields if key in tree}
    actuators = validate(BaseActuatorSettings, own, str(path))
    actuators.check(robot, name)
    return actuators
