"""The topics' quality of service, as the nodes use it and as `ros2 bag record` is told."""

from __future__ import annotations

import re
import subprocess
import sys
from typing import Any

import pytest
import yaml
from paths import CONFIG, DOCS

from space_robot_msgs_py import topics
from space_robot_msgs_py.samples import RobotNames, Timebase
from space_robot_msgs_py.wire.message import description

OVERRIDES = CONFIG / "qos/record_overrides.yaml"


def test_overrides_for_ros2_bag_record_are_the_topics_own() -> None:
    """Every topic with its depth and durability, and no other."""
    expected = {
        topic.full_name: {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
        }
        for topic in (*topics.RECORDED, *topics.FOR_OTHERS)
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
        (topic,) = (
            topic for topic in (*topics.RECORDED, *topics.FOR_OTHERS) if topic.full_name == name
        )
        assert read == of_the_nodes(topic), name


@pytest.mark.parametrize("page", ["bags", "namespaces"])
def test_overrides_of_a_robot_in_a_namespace_have_its_topics(page: str) -> None:
    """By the commands of the pages; topics of the whole domain keep their names."""
    found = re.findall(r"^    sed -E '(.+)' ", (DOCS / f"manual/{page}.md").read_text(), re.M)
    everywhere = (*topics.RECORDED, *topics.FOR_OTHERS)
    assert found
    for number, expression in enumerate(found, 1):
        command = ["sed", "-E", expression, str(OVERRIDES)]
        told = subprocess.run(command, capture_output=True, check=True, text=True).stdout
        assert set(yaml.safe_load(told)) == {t.in_namespace(f"/sat{number}") for t in everywhere}


@pytest.mark.parametrize("topic", topics.ALL, ids=lambda topic: topic.full_name)
def test_what_a_topics_messages_say_stands_in_the_module_of_its_name(topic: topics.Topic) -> None:
    """Our own message fits its own description; a law's is no columns of numbers."""
    found = description(topic)
    if found is None:
        assert topic is topics.LAW
        return
    described = found.of_robot(RobotNames(("a", "b"), ("c",), ("d",)), Timebase(500_000))
    width = sum(column.length for column in described.columns)
    assert not width or len(described.own(3).offsets) in (width, 3 * width)


def test_the_recorder_starts_without_the_compiler() -> None:
    """Half a second sooner; the descriptions of messages need it as little."""
    modules = ["space_robot_msgs_py.bag.recorder", "space_robot_msgs_py.bag.message_accounting"]
    names = [topic.name.replace("/", "_") for topic in topics.ALL]
    modules += [f"space_robot_msgs_py.wire.{name}" for name in [*names, "reference_codec"]]
    program = f"import sys, {', '.join(modules)}; sys.exit('numba' in sys.modules)"
    assert subprocess.run([sys.executable, "-c", program], check=False).returncode == 0
