"""Files of config/orbits: a file of an orbit has nothing but the settings of an orbit."""

from __future__ import annotations

from pathlib import Path

from space_robot_msgs_py.config.files import named_layers, node_parameters
from space_robot_msgs_py.config.text import printable
from space_robot_msgs_py.config.validation import read_yaml, validate
from space_robot_msgs_py.errors import InputError

from .orbit_settings import OrbitSettings

NODE, NONE = "plant", "none"
SECTIONS = ("plant_node", "/plant_node", "/**", "/**/plant_node")
"""Keys of a parameter file that are read by the plant."""


def orbit_layers(name: str) -> list[Path]:
    """Return the checked file of an orbit in a list; an empty list for none, or for numbers.

    Args:
        name: of config/orbits, or a path.

    Raises:
        InputError: there is no such file, or something in it is wrong or has no effect.
    """
    paths = [] if name == NONE else named_layers("orbits", name)
    for path in paths:
        read_orbit(path)
    return paths


def read_orbit(path: Path) -> OrbitSettings:
    """Read an orbit's file.

    Raises:
        InputError: something in it is wrong or has no effect; names file and key.
    """
    for key in read_yaml(path):
        if key in OrbitSettings.model_fields:
            raise InputError(
                f"{path}: {key}: it belongs into plant_node: {{ros__parameters: {{{key}: ...}}}}"
            )
        if key not in SECTIONS:
            raise InputError(
                f"{path}: {printable(str(key))}: an orbit has parameters of plant_node, and of no "
                "other node"
            )
    settings = validate(OrbitSettings, node_parameters(path, NODE), str(path))
    settings.check_orbit(str(path))
    return settings
