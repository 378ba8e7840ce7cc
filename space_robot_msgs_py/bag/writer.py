"""A rosbag2 bag of one MCAP file, as Jazzy's ``ros2 bag`` writes it (metadata version 9)."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml
from mcap.writer import CompressionType, Writer

from ..definitions import definition, jazzy
from ..errors import InputError
from ..topics import Topic

CHUNK_BYTES = 1 << 20
_FOREVER = {"sec": 9223372036, "nsec": 854775807}


def _qos(topic: Topic) -> list[dict[str, Any]]:
    return [
        {
            "history": "keep_last",
            "depth": topic.depth,
            "reliability": "reliable",
            "durability": "transient_local" if topic.transient_local else "volatile",
            "deadline": dict(_FOREVER),
            "lifespan": dict(_FOREVER),
            "liveliness": "automatic",
            "liveliness_lease_duration": dict(_FOREVER),
            "avoid_ros_namespace_conventions": False,
        }
    ]


class _PlainDumper(yaml.SafeDumper):
    """YAML without anchors, which rosbag2's reader does not need to know."""

    def ignore_aliases(self, data: Any) -> bool:
        return True


def _yaml(value: Any) -> str:
    return yaml.dump(value, Dumper=_PlainDumper, sort_keys=False, default_flow_style=False).strip()


class BagWriter:
    """Writes serialized messages; `close` makes the bag whole."""

    def __init__(self, path: Path, topics: Iterable[Topic]) -> None:
        """Create the bag's folder.

        Raises:
            InputError: it exists already, or cannot be written.
        """
        self._file_name = f"{path.name}_0.mcap"
        try:
            path.mkdir(parents=True)
            self._file = (path / self._file_name).open("wb")
        except FileExistsError:
            raise InputError(f"{path}: exists already; a bag is never overwritten") from None
        except OSError as error:
            raise InputError(f"{path}: no bag can be written there ({error.strerror})") from None
        self.path = path
        self._writer = Writer(self._file, chunk_size=CHUNK_BYTES, compression=CompressionType.LZ4)
        self._writer.start(profile="ros2", library="space_robot")
        self._channels = {topic.name: self._register(topic) for topic in topics}
        self._topics = {topic.name: topic for topic in topics}
        self._counts = dict.fromkeys(self._topics, 0)
        self._start_ns, self._end_ns = 2**63 - 1, 0

    def _register(self, topic: Topic) -> int:
        text = definition(topic.type).encode()
        schema = self._writer.register_schema(topic.type, "ros2msg", text)
        return self._writer.register_channel(
            topic.name,
            "cdr",
            schema,
            {
                "offered_qos_profiles": _yaml(_qos(topic)),
                "topic_type_hash": jazzy().hash_rihs01(topic.type),
            },
        )

    def write(self, topic: Topic, stamp_ns: int, data: bytes, sequence: int) -> None:
        """Add a message at a simulated time; ``sequence`` is its tick."""
        self._writer.add_message(
            self._channels[topic.name], stamp_ns, data, stamp_ns, sequence & 0xFFFFFFFF
        )
        self._counts[topic.name] += 1
        self._start_ns = min(self._start_ns, stamp_ns)
        self._end_ns = max(self._end_ns, stamp_ns)

    def close(self, custom_data: Mapping[str, str]) -> None:
        """Finish the MCAP file and write metadata.yaml with ``custom_data``."""
        information = self._information(dict(custom_data))
        self._writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(information)})
        self._writer.finish()
        self._file.close()
        text = _yaml({"rosbag2_bagfile_information": information}) + "\n"
        part = self.path / "metadata.yaml.part"
        part.write_text(text, encoding="utf-8")
        part.replace(self.path / "metadata.yaml")

    def _information(self, custom_data: dict[str, str]) -> dict[str, Any]:
        count = sum(self._counts.values())
        start = {"nanoseconds_since_epoch": self._start_ns}
        duration = {"nanoseconds": max(0, self._end_ns - self._start_ns) if count else 0}
        return {
            "version": 9,
            "storage_identifier": "mcap",
            "duration": duration,
            "starting_time": start,
            "message_count": count,
            "topics_with_message_count": [
                {
                    "topic_metadata": {
                        "name": topic.name,
                        "type": topic.type,
                        "serialization_format": "cdr",
                        "offered_qos_profiles": _qos(topic),
                        "type_description_hash": jazzy().hash_rihs01(topic.type),
                    },
                    "message_count": self._counts[topic.name],
                }
                for topic in self._topics.values()
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self._file_name],
            "files": [
                {
                    "path": self._file_name,
                    "starting_time": start,
                    "duration": duration,
                    "message_count": count,
                }
            ],
            "custom_data": custom_data or None,
            "ros_distro": "jazzy",
        }
