"""Only one of each: a topic of this graph has one publisher in a ROS domain.

Two plants or two controllers in one domain would answer each other's ticks. Nodes of this project
keep each other out with a lock that the kernel releases however a process ends: discovery would not
do, which lists a killed node for another 20 s, under the name of its successor. Other nodes take no
lock; discovery finds those.
"""

from __future__ import annotations

import fcntl
import os
import tempfile
from collections.abc import Sequence
from contextlib import ExitStack
from pathlib import Path

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..errors import InputError

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""What discovery calls the node of a publisher until its participant has said, if it ever does."""


class Claim:
    """This process' right to publish some topics of its domain, until it ends or lets go."""

    def __init__(self, node: Node, topic_names: Sequence[str]) -> None:
        """``topic_names``: what only this node may publish; resolved with its remappings.

        Raises:
            InputError: another node has one of them, or no lock can be had.
        """
        self._held = ExitStack()
        domain = node.context.get_domain_id()
        try:
            for name in topic_names:
                self._take(domain, node.resolve_topic_name(name), node.get_name())
        except BaseException:
            self.release()
            raise

    def _take(self, domain: int, topic: str, holder: str) -> None:
        descriptor = _open(lock_path(domain, topic))
        self._held.callback(os.close, descriptor)
        try:
            fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
        except BlockingIOError:
            other = os.pread(descriptor, 200, 0).decode(errors="replace") or "another node"
            raise InputError(
                f"{topic} of ROS domain {domain} is already published by {other}"
            ) from None
        os.ftruncate(descriptor, 0)
        os.pwrite(descriptor, f"{holder} (pid {os.getpid()})".encode(), 0)

    def release(self) -> None:
        """Let others have the topics."""
        self._held.close()


def lock_path(domain: int, topic: str) -> Path:
    """The file that is locked by the publisher of a topic; it stays when the lock goes."""
    # a ROS name has no dots, so no two topics share a file
    return Path(tempfile.gettempdir()) / f"space_robot_{domain}{topic.replace('/', '.')}.lock"


def _open(path: Path) -> int:
    """Open a lock file, for all users: a domain is the whole machine's."""
    flags = os.O_RDWR | os.O_NOFOLLOW
    try:
        if path.exists():  # Linux refuses O_CREAT for others' files in /tmp
            return os.open(path, flags)
        descriptor = os.open(path, flags | os.O_CREAT, 0o666)
        os.fchmod(descriptor, 0o666)  # past the umask
        return descriptor
    except OSError as error:
        raise InputError(f"{path}: no lock can be taken there ({error.strerror})") from None


def foreign_publishers(node: Node, topic_names: Sequence[str]) -> dict[str, list[str]]:
    """Full names of nodes other than this one that publish these topics; none: no entry.

    By name, as discovery sees it now: a killed node of this one's name is no stranger.
    """
    own = node.get_fully_qualified_name()
    strangers = {}
    for topic in topic_names:
        infos = node.get_publishers_info_by_topic(topic)
        names = {_full_name(info) for info in infos} - {own}
        if names:
            strangers[topic] = sorted(names)
    return strangers


def _full_name(info: TopicEndpointInfo) -> str:
    if info.node_name == UNNAMED:
        return "a DDS participant without a ROS node"
    return f"{info.node_namespace.rstrip('/')}/{info.node_name}"
