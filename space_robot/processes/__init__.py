"""Start, end and identify processes. Imports nothing, so that ``space-robot`` starts quickly."""

MODULES = {
    "plant": "space_robot_sim.plant_node",
    "controller": "space_robot_control.controller_node",
    "mission": "space_robot_control.mission_node",
    "recorder": "space_robot_msgs_py.recorder_node",
}
"""Modules of the nodes."""
SUFFIX = "_node"
"""Suffix of the names of nodes and their executables."""
COLLECTED_AT = 100_000
"""New objects after which Python searches for those that can be let go; by default 700."""
