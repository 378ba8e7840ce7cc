"""mission_node: streams the desired motion in chunks, in advance."""

from __future__ import annotations

from typing import NoReturn

from space_robot_msgs_py.ros.managed_node import NodeKind
from space_robot_msgs_py.ros.node_host import run_nodes

from .guidance.loop import MissionLoop
from .guidance.mission import MissionNodeSettings

NODE = NodeKind(MissionNodeSettings, MissionLoop, changeable=("goto",))


def main() -> NoReturn:
    """Entry point of mission_node."""
    run_nodes(NODE)


if __name__ == "__main__":
    main()
