"""The recorder listens to what is sent: nobody is told of subscribers without publishers."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import pytest
from flights import Start

from space_robot_msgs_py import topics

pytest.importorskip("rclpy")

if TYPE_CHECKING:
    from ground import Ground

OPTIONAL = (*topics.TRUTH, topics.WHEELS_STATE, topics.THRUSTERS_STATE)


def test_topics_of_some_flights_are_listened_to_once_they_are_published(
    start: Start, ground: Ground, tmp_path: Path
) -> None:
    from space_robot_msgs_py.ros.endpoints import RawPublisher

    def heard() -> set[topics.Topic]:
        every = (*OPTIONAL, topics.JOINT_STATES)
        return {topic for topic in every if ground.node.count_subscribers(topic.name)}

    start("recorder", bag=tmp_path / "bag")
    ground.until(lambda: ground.monitor.modes.get("recorder_node") == "nominal", "the recorder")
    ground.until(lambda: topics.JOINT_STATES in heard(), "what every flight has")
    assert heard() == {topics.JOINT_STATES}
    wheels = RawPublisher(ground.node, topics.WHEELS_STATE)
    ground.until(lambda: wheels.listener_count == 1, "a listener")
    assert heard() == {topics.JOINT_STATES, topics.WHEELS_STATE}
