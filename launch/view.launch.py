"""A flight, or a bag, with a picture: RViz where it is installed, else `space-robot view`.

    ros2 launch space_robot view.launch.py controller:=tde_tsmc realtime:=true
    ros2 launch space_robot view.launch.py play:=flights/BAG

It takes all arguments of fly.launch.py, and ends with the flight.
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
)
from launch.launch_description_sources import PythonLaunchDescriptionSource
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node

from space_robot.cli.launch_arguments import launch_arguments, refuse_unknown

RVIZ, PAGE = "rviz", "page"
VIEW = [sys.executable, "-m", "space_robot.cli.main", "view"]


def generate_launch_description() -> LaunchDescription:
    """Declare the arguments; what is started follows from their values."""
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
        ]
    )


def view(context: LaunchContext) -> list:
    """Start what shows, and what is shown."""
    refuse_unknown(
        sys.argv,
        __file__,
        [*(name for name, *_ in launch_arguments()), "autostart", "play", "viewer"],
    )
    bag = LaunchConfiguration("play").perform(context)
    viewer = LaunchConfiguration("viewer").perform(context) or (RVIZ if has_rviz() else PAGE)
    share = Path(get_package_share_directory("space_robot"))
    if viewer == PAGE and bag:
        return [ExecuteProcess(cmd=[*VIEW, bag], output="screen")]
    rviz = Node(
        package="rviz2",
        executable="rviz2",
        arguments=["-d", str(share / "config/views/fly.rviz")],
        parameters=[{"use_sim_time": True}],
    )
    if bag:  # its own /clock is played: no --clock, which would send a second one
        play = ExecuteProcess(cmd=["ros2", "bag", "play", bag], output="screen")
        return [rviz, play]
    page = ExecuteProcess(cmd=[*VIEW, "--live"], output="screen")
    source = PythonLaunchDescriptionSource(str(share / "launch/fly.launch.py"))
    return [rviz if viewer == RVIZ else page, IncludeLaunchDescription(source)]


def has_rviz() -> bool:
    """Tell whether RViz is installed."""
    try:
        get_package_prefix("rviz2")
    except PackageNotFoundError:
        return False
    return True
