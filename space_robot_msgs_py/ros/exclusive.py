"""Exclusive node names and exclusive publishers of topics in a ROS domain.

Two plants or two controllers in one domain would answer each other's ticks. Nodes of this project
exclude each other by `locks`. Other nodes have no locks and are found by discovery.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..errors import InputError
from .endpoints import full_name_of
from .locks import FileLock, HeldError, node_lock, topic_lock

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""Node name shown by discovery until the participant has announced its name."""


class TopicClaim:
    """Exclusive right of this process to publish some topics, until `release` or its end."""

    def __init__(self, node: Node, topic_names: Sequence[str]) -> None:
        """Claim ``topic_names``, resolved with the node's remappings.

        Raises:
            InputError: another node has claimed one of them, or a lock file cannot be created.
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
        try:
            lock = FileLock(topic_lock(domain, topic), holder)
        except HeldError as error:
            raise InputError(
                f"{topic} of ROS domain {domain} is already published by {error.holder.name}"
            ) from None
        self._held.callback(lock.release)

    def release(self) -> None:
        """Release the topics."""
        self._held.close()


def claim_name(node: Node) -> FileLock:
    """Claim the node's name, so that service calls by name reach one node only.

    Raises:
        InputError: another node of this project has it, or the lock file cannot be created.
    """
    domain, name = node.context.get_domain_id(), node.get_fully_qualified_name()
    try:
        return FileLock(node_lock(domain, name), node.get_name())
    except HeldError as error:
        raise InputError(
            f"ROS domain {domain} has a {name} already: {error.holder.name}; end that one, "
            "or use another domain (ROS_DOMAIN_ID) or name (--ros-args -r __node:=...)"
        ) from None


def foreign_publishers(
    node: Node, topic_names: Sequence[str], own: Sequence[str] = ()
) -> dict[str, list[str]]:
    """Return full names of other nodes that publish some topics, by full topic name.

    They are compared by name, as discovered now: a killed node with this node's name is not
    foreign. Topics without foreign publishers are omitted.

    Args:
        node: this node.
        topic_names: to look for.
        own: full names of further nodes that are not foreign.
    """
    known = {node.get_fully_qualified_name(), *own}
    foreign = {}
    for topic in topic_names:
        infos = node.get_publishers_info_by_topic(topic)
        names = {_full_name(info) for info in infos} - known
        if names:
            foreign[node.resolve_topic_name(topic)] = sorted(names)
    return foreign


def _full_name(info: TopicEndpointInfo) -> str:
    if info.node_name == UNNAMED:
        return "a DDS participant without a ROS node"
    return full_name_of(info)
