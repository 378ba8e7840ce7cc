"""Simulation: environment, sensors, actuators, faults, and the plant."""

from __future__ import annotations

from space_robot_msgs_py.deprecation import moved_names

__getattr__ = moved_names(
    __name__,
    {
        name: "space_robot"
        for name in ("Robot", "bias_force", "forward_dynamics", "load_bag", "mass_matrix")
    },
)
