"""A flight as four lifecycle nodes: recorder, mission, controller, plant.

    ros2 launch space_robot fly.launch.py controller:=tde_tsmc case:=4-2
    ros2 launch space_robot fly.launch.py --show-args

The arguments are the options of `space-robot fly`. The launch ends with its last flight; the exit
code is 0 if all flights are complete, else 1. With `shutdown:=false` it goes on after this flight.
"""

import sys
from pathlib import Path
from shutil import rmtree
from tempfile import mkdtemp

from launch import LaunchContext, LaunchDescription, Substitution
from launch.actions import (
    DeclareLaunchArgument,
    EmitEvent,
    LogInfo,
    OpaqueFunction,
    RegisterEventHandler,
    SetEnvironmentVariable,
    Shutdown,
)
from launch.event_handlers import OnProcessExit, OnShutdown
from launch.events.process import ProcessExited, ShutdownProcess
from launch.substitutions import EnvironmentVariable, LaunchConfiguration
from launch_ros.actions import LifecycleNode

from space_robot.cli.launch_arguments import (
    PACKAGE,
    launch_arguments,
    launched_flight,
    refuse_unknown,
)
from space_robot.flight.graph.node_names import started_nodes
from space_robot.flight.graph.orchestrator import LaunchedGraph, launched_parameters, report_failure
from space_robot_msgs_py.ros.process import defaults

AUTOSTART, SHUTDOWN = "autostart", "shutdown"
GRAPHS = "space_robot_graphs"
"""Name of the list of this launch's flights in the context of launch."""
RECORDER_S = "20"
"""What a recorder that is told to stop may need to write what has come."""


class OptionDefault(Substitution):
    """Default of an option: shown by --show-args, else empty, since the option itself has it."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self._text = text

    def describe(self) -> str:
        """Return the default as it is shown."""
        return repr(self._text)

    def perform(self, context: LaunchContext) -> str:
        """Return no value: a scenario's goes before the default."""
        return ""


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; the nodes follow from their values."""
    environment = [
        SetEnvironmentVariable(name, EnvironmentVariable(name, default_value=value))
        for name, value in defaults().items()
    ]
    arguments = [
        DeclareLaunchArgument(
            name,
            default_value=OptionDefault(default),
            description=description,
            choices=choices or None,
        )
        for name, description, choices, default in launch_arguments()
    ]
    arguments += [
        DeclareLaunchArgument(
            name, default_value="true", choices=("true", "false"), description=description
        )
        for name, description in (
            (AUTOSTART, "Nodes configure and activate themselves; false: they await transitions."),
            (SHUTDOWN, "The launch ends with its last flight; false: not with this one."),
        )
    ]
    return LaunchDescription([*environment, *arguments, OpaqueFunction(function=fly)])


def fly(context: LaunchContext) -> list:
    """Check the flight, and start its nodes."""

    def value(name: str) -> str:
        return LaunchConfiguration(name).perform(context)

    names = [name for name, *_ in launch_arguments()]
    refuse_unknown(sys.argv, __file__, [*names, AUTOSTART, SHUTDOWN])
    group = context.launch_configurations.get("ros_namespace", "")  # as PushRosNamespace sets it
    flight, bag, ros_parameters = launched_flight({name: value(name) for name in names}, group)
    folder = Path(mkdtemp(prefix="space_robot_launch_"))
    file = launched_parameters(flight, bag, value(AUTOSTART) == "true", folder, ros_parameters)
    namespace = flight.scenario.options.namespace
    node_names = started_nodes(flight.scenario.options.without)
    nodes = [
        LifecycleNode(
            package=PACKAGE,
            executable=name,
            name=name,
            namespace=namespace,
            parameters=[str(file)],
            output="screen",
            sigterm_timeout=RECORDER_S,
        )
        for name in node_names
    ]
    graph = LaunchedGraph(node_names)
    graphs = context.get_locals_as_dict().get(GRAPHS, [])
    if value(SHUTDOWN) == "true":
        graphs.append(graph)
        context.extend_globals({GRAPHS: graphs})

    def end(event: ProcessExited, context: LaunchContext) -> list:
        """End the flight with the first node that ends, and the launch with its last flight."""
        name = event.action.node_name.rpartition("/")[2]
        if failure := graph.note_end(name, event.returncode, context.is_shutdown):
            report_failure(context, f"{bag}: {failure}")
        if context.is_shutdown:
            return []
        if graph in graphs and all(other.has_ended for other in graphs):
            return [Shutdown(reason="the last flight has ended")]
        return [EmitEvent(event=ShutdownProcess(process_matcher=lambda action: action in nodes))]

    return [
        RegisterEventHandler(OnShutdown(on_shutdown=lambda *_: rmtree(folder))),
        LogInfo(msg=f"recording to {bag}"),
        RegisterEventHandler(
            OnProcessExit(target_action=lambda action: action in nodes, on_exit=end)
        ),
        *nodes,
    ]
