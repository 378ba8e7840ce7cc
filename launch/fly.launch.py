"""A flight as four lifecycle nodes: recorder, mission, controller, plant.

    ros2 launch space_robot fly.launch.py controller:=tde_tsmc case:=4-2
    ros2 launch space_robot fly.launch.py --show-args

The arguments are the options of `space-robot fly`. It ends when the plant has come to its end, with
exit code 0, or when any node ends before, with exit code 1.
"""

import sys
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import LifecycleNode

from space_robot.cli.launch_arguments import launch_arguments, launched_flight, refuse_unknown
from space_robot.flight.graph.launched import launched_parameters
from space_robot.flight.graph.node_names import started_nodes
from space_robot_msgs_py.ros.process_environment import defaults

PACKAGE = "space_robot"
AUTOSTART = "autostart"
RECORDER_S = "20"
"""What a recorder that is told to stop may need to write what has come."""


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the nodes follow from their values."""
    environment = [
        SetEnvironmentVariable(name, EnvironmentVariable(name, default_value=value))
        for name, value in defaults().items()
    ]
    arguments = [
        DeclareLaunchArgument(
            name, default_value="", description=description, choices=choices or None
        )
        for name, description, choices in launch_arguments()
    ]
    autostart = DeclareLaunchArgument(
        AUTOSTART,
        default_value="true",
        choices=("true", "false"),
        description="Nodes configure and activate themselves; false: they wait for transitions.",
    )
    return LaunchDescription([*environment, *arguments, autostart, OpaqueFunction(function=fly)])


def fly(context: LaunchContext) -> list:
    """Check the flight, and start its nodes."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    names = [name for name, *_ in launch_arguments()]
    refuse_unknown(sys.argv, __file__, [*names, AUTOSTART])
    flight, bag = launched_flight({name: value(name) for name in names})
    folder = Path(mkdtemp(prefix="space_robot_launch_"))
    file = launched_parameters(flight, bag, value(AUTOSTART) == "true", folder)
    nodes = [
        LifecycleNode(
            package=PACKAGE,
            executable=name,
            name=name,
            namespace=flight.scenario.options.namespace,
            parameters=[str(file)],
            output="screen",
            sigterm_timeout=RECORDER_S,
        )
        for name in started_nodes(flight.scenario.options.without)
    ]
    return [
        RegisterEventHandler(OnShutdown(on_shutdown=lambda *_: rmtree(folder))),
        LogInfo(msg=f"recording to {bag}"),
        *(RegisterEventHandler(OnProcessExit(target_action=n, on_exit=ended)) for n in nodes),
        *nodes,
    ]


def ended(event: object, context: LaunchContext) -> Shutdown | None:
    """End the launch with the first node that ends.

    Raises:
        RuntimeError: the flight is not complete; `ros2 launch` then ends with exit code 1.
    """
    name, code = event.action.node_name.strip("/"), event.returncode
    if code:
        raise RuntimeError(f"{name} ended with exit code {code}")
    if context.is_shutdown:
        return None
    if not name.endswith("plant_node"):
        raise RuntimeError(f"{name} ended before the flight did")
    return Shutdown(reason="the flight is complete")
