"""ROS 2 on this machine: rclpy, the middleware, the domain that a flight would take."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from typing import Any

from space_robot_msgs_py.config.text import one_line_of
from space_robot_msgs_py.errors import SpaceRobotError
from space_robot_msgs_py.ros.process import defaults

from ..flight.graph.domain import domain_asked_for, is_quiet, ros_domain
from ..flight.graph.processes import has_ros2_run
from .checked_item import ROS, CheckedItem

WHEEL = "ros-jazzy-rclpy"
"""Package that brings rclpy by pip."""
DISTRIBUTION = "jazzy"
INSTALL = (
    "source /opt/ros/jazzy/setup.bash if ROS 2 is installed, or install the extra ros; "
    "simulate flies without ROS"
)


def check_ros(environment: Mapping[str, str] = os.environ) -> Iterator[CheckedItem]:
    """Report ROS 2, its middleware, and the domain; only the first where there is no ROS.

    Args:
        environment: variables as in ``os.environ``.
    """
    try:
        rclpy = import_module("rclpy")
        identifier: str = import_module("rclpy.utilities").get_rmw_implementation_identifier()
    except Exception as error:  # a broken installation fails in many ways
        text = f"rclpy cannot be imported ({one_line_of(error)})"
        yield CheckedItem(ROS, "missing", text, INSTALL)
        return
    yield check_distribution(str(rclpy.__file__), environment)
    yield check_middleware(identifier, environment)
    yield check_domain()


def check_distribution(file: str, environment: Mapping[str, str]) -> CheckedItem:
    """Report which ROS 2 rclpy belongs to.

    Args:
        file: of rclpy.
        environment: variables; ``ROS_DISTRO`` is set by ROS's ``setup.bash``.
    """
    wheel = _version(WHEEL)
    distribution = environment.get("ROS_DISTRO") or (DISTRIBUTION if wheel else "unknown")
    origin = f"wheel {WHEEL} {wheel}" if wheel else "no wheel"
    starts = "`ros2 run`" if has_ros2_run() else "Python"
    text = f"{distribution}, rclpy from {file} ({origin}); nodes are started through {starts}"
    values = {"distribution": distribution, "rclpy": file, "wheel": wheel}
    if distribution == DISTRIBUTION:
        return CheckedItem(ROS, "ok", text, values=values)
    advice = "the project is tested with ROS 2 Jazzy: source /opt/ros/jazzy/setup.bash"
    return CheckedItem(ROS, "warning", text, advice, values)


def check_middleware(identifier: str, environment: Mapping[str, str]) -> CheckedItem:
    """Report the middleware with the transports and the discovery range that flights have.

    Args:
        identifier: of the middleware, as ``rmw_fastrtps_cpp``.
        environment: variables of the user, which come before the project's defaults.
    """
    effective = {**defaults(), **environment}
    names = (
        "ROS_AUTOMATIC_DISCOVERY_RANGE",
        "ROS_STATIC_PEERS",
        "FASTDDS_BUILTIN_TRANSPORTS",
        "FASTRTPS_DEFAULT_PROFILES_FILE",
        "CYCLONEDDS_URI",
    )
    values: dict[str, Any] = {name: effective[name] for name in names if effective.get(name)}
    values["rmw"] = identifier
    discovery, transports = effective[names[0]], effective[names[2]]
    text = f"{identifier}, discovery {discovery}, transports {transports}"
    if discovery == "LOCALHOST" and not effective.get("ROS_STATIC_PEERS"):
        return CheckedItem("middleware", "ok", text, values=values)
    advice = (
        "export ROS_AUTOMATIC_DISCOVERY_RANGE=LOCALHOST and unset ROS_STATIC_PEERS, unless nodes "
        "of other machines are to take part"
    )
    return CheckedItem("middleware", "warning", text, advice, values)


def check_domain(number: int | None = None) -> CheckedItem:
    """Report the ROS domain that a flight would take now; it is taken and released.

    Args:
        number: a domain; None: ``ROS_DOMAIN_ID``, or a free one.
    """
    asked = domain_asked_for(number)
    try:
        with ros_domain(number) as domain:
            is_empty = is_quiet(domain)
    except SpaceRobotError as error:
        advice = "unset ROS_DOMAIN_ID, so that each flight takes a free domain, or set a free one"
        return CheckedItem("ROS domain", "warning", str(error), advice, {"domain": asked})
    chosen = "chosen by you" if asked is not None else "free; a flight takes such a one by itself"
    values = {"domain": domain, "is_empty": is_empty}
    if is_empty:
        return CheckedItem("ROS domain", "ok", f"{domain} ({chosen})", values=values)
    text = f"{domain} ({chosen}): other programs may be in it"
    advice = "none if you know them; else take another domain with --domain"
    return CheckedItem("ROS domain", "warning", text, advice, values)


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None
