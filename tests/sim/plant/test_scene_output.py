"""A plant tells who comes late what its robot looks like, and the recorder where it is."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import TYPE_CHECKING

import pytest

from space_robot_model.robot import Robot
from space_robot_model.robot.urdf_text import urdf_text
from space_robot_msgs_py import topics
from space_robot_msgs_py.wire.carrier import unwrap
from space_robot_msgs_py.wire.definitions import decode

pytest.importorskip("rclpy")

from space_robot_msgs_py.ros.locks import look, topic_lock

if TYPE_CHECKING:
    from ground import Ground

    from space_robot_msgs_py.ros.endpoints import RawSubscription


def wait_for_message(ground: Ground, subscription: RawSubscription) -> bytes:
    heard: list[bytes] = []

    def has_come() -> bool:
        if data := subscription.take():
            heard.append(data)
        return bool(heard)

    ground.until(has_come, subscription.full_name)
    time.sleep(0.1)
    assert subscription.take() is None, "once"
    return heard[0]


def test_who_comes_late_is_told_all_that_holds_for_the_flight(
    start: Callable[..., object], ground: Ground, domain: int, paper_robot: Robot
) -> None:
    """The plant has sent its first state, and waits for an answer, when the listener comes.

    It has claimed what it does not send, too, so others' messages there are foreign.
    """
    from space_robot_msgs_py.ros.endpoints import PolledCallbackGroup, RawSubscription

    start("plant")
    ground.until(lambda: ground.value("plant", "sent /joint_states") > 0, "the first state")
    group = PolledCallbackGroup()
    description, static = (
        RawSubscription(ground.node, topic, group)
        for topic in (topics.ROBOT_DESCRIPTION, topics.TRANSFORMS_STATIC)
    )
    text = decode(wait_for_message(ground, description), topics.ROBOT_DESCRIPTION.type).data
    assert text.rstrip("\n") == urdf_text(paper_robot).rstrip("\n")
    (tool,) = decode(unwrap(wait_for_message(ground, static)), topics.TF_STATIC.type).transforms
    assert (tool.header.frame_id, tool.child_frame_id) == ("link6", "tool")
    for topic in (topics.ROBOT_DESCRIPTION, topics.TRANSFORMS, topics.WHEELS_STATE):
        is_held, _ = look(topic_lock(domain, topic.full_name))
        assert is_held, topic
