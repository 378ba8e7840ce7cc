"""The topics' quality of service, as the nodes use it and as `ros2 bag record` is told."""

from __future__ import annotations

from typing import Any

import pytest
import yaml
from paths import CONFIG

from space_robot_msgs_py import topics

OVERRIDES = CONFIG / "qos/record_overrides.yaml"


def test_overrides_for_ros2_bag_record_are_the_topics_own() -> None:
    """Every topic with its depth and durability, and no other."""
    expected = {
        topic.name: {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
        }
        for topic in topics.ALL
    }
    assert yaml.safe_load(OVERRIDES.read_text("utf-8")) == expected


def test_ros2_bag_reads_the_overrides_as_the_nodes_quality_of_service() -> None:
    """Read key by key as ros2bag.api does, the profiles are those of our own endpoints."""
    qos = pytest.importorskip("rclpy.qos")
    from space_robot_msgs_py.ros.endpoints import qos as of_the_nodes

    policies: dict[str, Any] = {
        "history": qos.HistoryPolicy.get_from_short_key,
        "reliability": qos.ReliabilityPolicy.get_from_short_key,
        "durability": qos.DurabilityPolicy.get_from_short_key,
        "depth": int,
    }
    for name, profile in yaml.safe_load(OVERRIDES.read_text("utf-8")).items():
        read = qos.QoSProfile(**{key: policies[key](value) for key, value in profile.items()})
        assert read == of_the_nodes(topics.BY_NAME[name]), name
