"""The YAML of rosbag2: metadata.yaml and the QoS profiles of a channel (version 9, Jazzy's)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import yaml

from ..topics import Topic
from ..wire.definitions import jazzy

_FOREVER = {"sec": 9223372036, "nsec": 854775807}
_NEVER_NS = 2**63 - 1
"""The start of a bag without a message."""


class FileSummary(NamedTuple):
    """The entry of one file in metadata.yaml."""

    name: str
    span_ns: tuple[int, int] | None
    """First and last log time (None: no message)."""
    message_count: int


class _Dumper(yaml.SafeDumper):
    """Writes as rosbag2 (yaml-cpp) does."""

    def ignore_aliases(self, data: Any) -> bool:
        """No anchors, which other readers need not know."""
        return True

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        """Sequences are indented below their key."""
        super().increase_indent(flow, False)


_Dumper.add_representer(
    type(None), lambda dumper, _: dumper.represent_scalar("tag:yaml.org,2002:null", "~")
)
_Dumper.add_representer(
    str,
    lambda dumper, text: dumper.represent_scalar(
        "tag:yaml.org,2002:str", text, style=None if text else '"'
    ),
)


def to_yaml(value: Any) -> str:
    """Text as rosbag2 writes it, without a line's end."""
    return yaml.dump(
        value, Dumper=_Dumper, sort_keys=False, default_flow_style=False, width=math.inf
    ).strip()


def qos_profiles(topic: Topic) -> list[dict[str, Any]]:
    """The QoS a topic is offered with."""
    return [
        {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
            "deadline": _FOREVER,
            "lifespan": _FOREVER,
            "liveliness": "automatic",
            "liveliness_lease_duration": _FOREVER,
            "avoid_ros_namespace_conventions": False,
        }
    ]


def bag_information(
    files: Sequence[FileSummary], topics: Sequence[tuple[Topic, int]], custom: Mapping[str, str]
) -> dict[str, Any]:
    """Return what metadata.yaml says of a bag.

    Args:
        files: in the order of their writing.
        topics: each with its number of messages.
        custom: the custom data.
    """
    start, duration = _times([file.span_ns for file in files])
    return {
        "version": 9,
        "storage_identifier": "mcap",
        "duration": duration,
        "starting_time": start,
        "message_count": sum(file.message_count for file in files),
        "topics_with_message_count": [
            {
                "topic_metadata": {
                    "name": topic.full_name,
                    "type": topic.type,
                    "serialization_format": "cdr",
                    "offered_qos_profiles": qos_profiles(topic),
                    "type_description_hash": jazzy().hash_rihs01(topic.type),
                },
                "message_count": count,
            }
            for topic, count in topics
        ],
        # of whole files or messages, which rosbag2 does beside MCAP; chunks say it themselves
        "compression_format": "",
        "compression_mode": "",
        "relative_file_paths": [file.name for file in files],
        "files": [_file_information(file) for file in files],
        "custom_data": dict(custom) or None,
        "ros_distro": "jazzy",
    }


def _file_information(file: FileSummary) -> dict[str, Any]:
    start, duration = _times([file.span_ns])
    return {
        "path": file.name,
        "starting_time": start,
        "duration": duration,
        "message_count": file.message_count,
    }


def _times(spans_ns: Sequence[tuple[int, int] | None]) -> tuple[dict[str, int], dict[str, int]]:
    """Start and duration of what has these first and last log times."""
    known = [span for span in spans_ns if span]
    first = min((span[0] for span in known), default=_NEVER_NS)
    last = max((span[1] for span in known), default=_NEVER_NS)
    return {"nanoseconds_since_epoch": first}, {"nanoseconds": last - first}
