"""The YAML of rosbag2: metadata.yaml and the QoS profiles of a channel (version 9, Jazzy's)."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from io import StringIO
from typing import Any, NamedTuple
from uuid import uuid4

import yaml

from ..topics import Topic
from ..wire.definitions import jazzy

_FOREVER = {"sec": 9223372036, "nsec": 854775807}
_NEVER_NS = 2**63 - 1
"""The start of a bag without a message."""
_LONG = 10_000
"""Characters of a text that PyYAML takes too long for: it looks at each of them in Python."""


class FileSummary(NamedTuple):
    """The entry of one file in metadata.yaml."""

    name: str
    span_ns: tuple[int, int] | None
    """First and last log time (None: no message)."""
    message_count: int


class _Dumper(yaml.SafeDumper):
    """Writes as rosbag2 (yaml-cpp) does; PyYAML's C code cannot indent sequences so."""

    def __init__(self, *arguments: Any, **options: Any) -> None:
        super().__init__(*arguments, **options)
        self.long_texts: dict[str, str] = {}
        """By what stands for them."""

    def ignore_aliases(self, data: Any) -> bool:
        """No anchors, which other readers need not know."""
        return True

    def represent_text(self, text: str) -> yaml.ScalarNode:
        """Represent a text; a long one of JSON by a short one that stands for it."""
        if len(text) > _LONG and text[0] in "{[" and text.isascii() and text.isprintable():
            name = f"{{{uuid4()}}}"
            self.long_texts[f"'{name}'"] = "'" + text.replace("'", "''") + "'"
            text = name
        return self.represent_scalar("tag:yaml.org,2002:str", text, style=None if text else '"')

    def increase_indent(self, flow: bool = False, indentless: bool = False) -> None:
        """Sequences are indented below their key."""
        super().increase_indent(flow, False)


_Dumper.add_representer(
    type(None), lambda dumper, _: dumper.represent_scalar("tag:yaml.org,2002:null", "~")
)
_Dumper.add_representer(str, _Dumper.represent_text)


def to_yaml(value: Any) -> str:
    """Return the text that rosbag2 writes, without a line's end."""
    stream = StringIO()
    dumper = _Dumper(stream, sort_keys=False, default_flow_style=False, width=math.inf)
    dumper.open()
    dumper.represent(value)
    dumper.close()
    text = stream.getvalue()
    for name, long_text in dumper.long_texts.items():
        text = text.replace(name, long_text)
    return text.strip()


def qos_profiles(topic: Topic) -> list[dict[str, Any]]:
    """Return the QoS a topic is offered with."""
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
    whole = sum(file.message_count for file in files)
    return {
        "version": 9,
        "storage_identifier": "mcap",
        **_times([file.span_ns for file in files], "duration", "starting_time"),
        "message_count": whole,
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
        "files": [
            {
                "path": file.name,
                **_times([file.span_ns], "starting_time", "duration"),
                "message_count": file.message_count,
            }
            for file in files
        ],
        "custom_data": dict(custom) or None,
        "ros_distro": "jazzy",
    }


def _times(spans_ns: Sequence[tuple[int, int] | None], *keys: str) -> dict[str, dict[str, int]]:
    """Return start and duration of what has these first and last log times, in a key order."""
    known = [span for span in spans_ns if span]
    first = min((span[0] for span in known), default=_NEVER_NS)
    last = max((span[1] for span in known), default=_NEVER_NS)
    times = {
        "starting_time": {"nanoseconds_since_epoch": first},
        "duration": {"nanoseconds": last - first},
    }
    return {key: times[key] for key in keys}
