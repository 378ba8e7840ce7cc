"""A flight, or a bag, with a picture: RViz where it is installed, else `space-robot view`.

    ros2 launch space_robot view.launch.py controller:=tde_tsmc realtime:=true
    ros2 launch space_robot view.launch.py play:=flights/BAG

It takes all arguments of fly.launch.py, and ends with the flight. A viewer that fails does not end
it; the exit code is 1 then.
"""

import sys
from pathlib import Path

from ament_index_python.packages import (
    PackageNotFoundError,
    get_package_prefix,
    get_package_share_directory,
)
from launch import LaunchContext, LaunchDescription
from launch.actions import (
    DeclareLaunchArgument,
    ExecuteProcess,
    IncludeLaunchDescription,
    OpaqueFunction,
    RegisterEventHandler,
)
from launch.conditions import IfCondition
from launch.event_handlers import OnProcessExit
from launch.events.process import ProcessExited
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import EqualsSubstitution, LaunchConfiguration
from launch_ros.actions import Node

from space_robot.cli.launch_arguments import launch_arguments, refuse_unknown
from space_robot.flight.graph.orchestrator import report_failure

RVIZ, PAGE = "rviz", "page"
VIEW = [sys.executable, "-m", "space_robot.cli.main", "view"]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; what is started follows from their values."""
    source = PythonLaunchDescriptionSource(str(Path(__file__).with_name("fly.launch.py")))
    flies = IfCondition(EqualsSubstitution(LaunchConfiguration("play"), ""))
    return LaunchDescription(
        [
            DeclareLaunchArgument(
                "play", default_value="", description="A bag to be shown, in place of a flight."
            ),
            DeclareLaunchArgument(
                "viewer",
                default_value="",
                choices=("", RVIZ, PAGE),
                description="rviz, or the page of `space-robot view` [default: rviz if it is "
                "there].",
            ),
            OpaqueFunction(function=view),
            IncludeLaunchDescription(source, condition=flies),
        ]
    )


def view(context: LaunchContext) -> list:
    """Start the viewer, and what plays the bag if it is no flight that is shown."""
    names = [name for name, *_ in launch_arguments()]
    refuse_unknown(sys.argv, __file__, [*names, "autostart", "shutdown", "play", "viewer"])
    bag = LaunchConfiguration("play").perform(context)
    viewer = LaunchConfiguration("viewer").perform(context) or (RVIZ if has_rviz() else PAGE)
    share = Path(get_package_share_directory("space_robot"))
    if viewer == PAGE:
        started = [ExecuteProcess(cmd=[*VIEW, bag or "--live"], output="screen")]
    else:
        rviz = Node(
            package="rviz2",
            executable="rviz2",
            arguments=["-d", str(share / "config/views/fly.rviz")],
            parameters=[{"use_sim_time": True}],
        )
        # a bag's own /clock is played: no --clock, which would send a second one
        play = [ExecuteProcess(cmd=["ros2", "bag", "play", bag], output="screen")] if bag else []
        started = [rviz, *play]
    handlers = [OnProcessExit(target_action=action, on_exit=check_end) for action in started]
    return [*map(RegisterEventHandler, handlers), *started]


def check_end(event: ProcessExited, context: LaunchContext) -> None:
    """Report a viewer, or player, that has failed."""
    if event.returncode and not context.is_shutdown:
        report_failure(context, f"{event.process_name} ended with exit code {event.returncode}")


def has_rviz() -> bool:
    """Tell whether RViz is installed."""
    try:
        get_package_prefix("rviz2")
    except PackageNotFoundError:
        return False
    return True
