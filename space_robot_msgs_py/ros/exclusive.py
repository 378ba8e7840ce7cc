"""Exclusive node names and exclusive publishers of topics in a ROS domain.

Two plants or two controllers in one domain would answer each other's ticks. Nodes of this project
keep each other out with `locks`. Other nodes take none; discovery finds those.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import ExitStack

from rclpy.node import Node
from rclpy.topic_endpoint_info import TopicEndpointInfo

from ..errors import InputError
from ..wire.sources import Claimed
from .endpoints import full_name_of
from .locks import FileLock, HeldError, look, node_lock, topic_lock

UNNAMED = "_NODE_NAME_UNKNOWN_"
"""Name that discovery gives to a node until its participant has announced its own."""


class TopicClaim:
    """This process' right to publish some topics of its domain, until it ends or lets go."""

    def __init__(self, node: Node, topic_names: Sequence[str]) -> None:
        """``topic_names``: what only this node may publish; resolved with its remappings.

        Raises:
            InputError: another node has one of them, or no lock can be had.
        """
        self._held = ExitStack()
        domain = node.context.get_domain_id()
        own = node.get_fully_qualified_name()
        try:
            for name in topic_names:
                listed = node.get_publishers_info_by_topic(name)
                gids = [gid_of(info).hex() for info in listed if _full_name(info) == own]
                self._take(domain, node.resolve_topic_name(name), node.get_name(), gids)
        except BaseException:
            self.release()
            raise

    def _take(self, domain: int, topic: str, holder: str, gids: Sequence[str]) -> None:
        try:
            lock = FileLock(topic_lock(domain, topic), holder, gids)
        except HeldError as error:
            raise InputError(
                f"{topic} of ROS domain {domain} is already published by {error.holder.name}"
            ) from None
        self._held.callback(lock.release)

    def release(self) -> None:
        """Let others have the topics."""
        self._held.close()


def claim_name(node: Node) -> FileLock:
    """This process' right to its node's name: who calls a service by name means one node.

    Raises:
        InputError: another node of this project has it, or no lock can be had.
    """
    domain, name = node.context.get_domain_id(), node.get_fully_qualified_name()
    try:
        return FileLock(node_lock(domain, name), node.get_name())
    except HeldError as error:
        raise InputError(
            f"ROS domain {domain} has a {name} already: {error.holder.name}; end that one, "
            "or take another domain (ROS_DOMAIN_ID) or name (--ros-args -r __node:=...)"
        ) from None


class GraphPublishers:
    """Who publishes the topics of a node's domain: by the claims on them, and by discovery."""

    def __init__(self, node: Node) -> None:
        self._node = node

    def claimed(self, topic: str) -> Claimed:
        """Return the owner of the claim of a topic on this machine."""
        domain = self._node.context.get_domain_id()
        is_held, notes = look(topic_lock(domain, self._node.resolve_topic_name(topic)))
        return Claimed(tuple(gid for text in notes if (gid := _gid(text))), is_held)

    def names(self, topic: str) -> dict[bytes, str]:
        """Full node name by GID of all that are listed now; empty of one without a name."""
        infos = self._node.get_publishers_info_by_topic(topic)
        return {
            gid_of(info): "" if info.node_name == UNNAMED else _full_name(info) for info in infos
        }


def gid_of(info: TopicEndpointInfo) -> bytes:
    """The identity that a publisher's messages carry."""
    return bytes(info.endpoint_gid)


def _gid(text: str) -> bytes:
    try:
        return bytes.fromhex(text)
    except ValueError:
        return b""


def foreign_publishers(
    node: Node, topic_names: Sequence[str], own: Sequence[str] = ()
) -> dict[str, list[str]]:
    """Full names of nodes other than this one by full topic name; of a topic without: no entry.

    By name, as discovery sees it now: a killed node of this one's name is not foreign. ``own``:
    full names of further nodes that are none.
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
