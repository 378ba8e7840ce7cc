"""controller_node: answers every state with a command, under a law that can be swapped live."""

from __future__ import annotations

from functools import partial
from typing import NoReturn

from space_robot_msgs_py.ros.managed_node import NodeKind
from space_robot_msgs_py.ros.node_host import run_nodes

from .controller.loop import ControllerLoop
from .controller.settings import ControllerNodeSettings
from .flight_code.supervisors import make_supervisor

NODE = NodeKind(
    ControllerNodeSettings,
    partial(ControllerLoop, make_supervisor=make_supervisor),
    changeable=("controller",),
)


def main() -> NoReturn:
    """Entry point of controller_node."""
    run_nodes(NODE)


if __name__ == "__main__":
    main()
