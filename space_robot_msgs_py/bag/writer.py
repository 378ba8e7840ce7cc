"""A rosbag2 bag of one MCAP file, as Jazzy's ``ros2 bag`` writes it (metadata version 9)."""

from __future__ import annotations

import errno
import os
import sys
from collections.abc import Iterable, Mapping
from contextlib import suppress
from pathlib import Path
from typing import Any

import yaml
from mcap.data_stream import RecordBuilder
from mcap.records import DataEnd, Footer
from mcap.writer import MCAP0_MAGIC, CompressionType, Writer

from ..definitions import definition, jazzy
from ..errors import InputError
from ..topics import Topic

DESCRIPTION = "space_robot"
"""Name of the metadata record at the file's beginning."""
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


def _bare_end() -> bytes:
    """The end of an MCAP file without a summary."""
    builder = RecordBuilder()
    DataEnd(data_section_crc=0).write(builder)
    Footer(summary_start=0, summary_offset_start=0, summary_crc=0).write(builder)
    return bytes(builder.end()) + MCAP0_MAGIC


class BagWriter:
    """Writes serialized messages; `flush` ends a chunk, `close` makes the bag whole."""

    def __init__(self, path: Path, topics: Iterable[Topic], description: Mapping[str, str]) -> None:
        """Create the bag's folder, and its file with ``description`` at the beginning.

        Raises:
            InputError: it exists already, or cannot be written.
        """
        self.path = path
        self._file_path = path / f"{path.name}_0.mcap"
        try:
            path.mkdir(parents=True)
            self._file = self._file_path.open("wb")
            # no chunk ends by itself: so it is known at any time what is in the file
            self._writer = Writer(
                self._file, chunk_size=sys.maxsize, compression=CompressionType.LZ4
            )
            self._writer.start(profile="ros2", library="space_robot")
            self._writer.add_metadata(DESCRIPTION, dict(description))
            self._topics = tuple(topics)
            self._channels = {topic.name: self._register(topic) for topic in self._topics}
            self.flush()
        except FileExistsError:
            raise InputError(f"{path}: exists already; a bag is never overwritten") from None
        except OSError as error:
            raise InputError(f"{path}: no bag can be written there ({error.strerror})") from None

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

    def write(self, topic: Topic, stamp_ns: int, data: bytes, sequence: int) -> int:
        """Add a message at a simulated time; ``sequence`` is its tick.

        Returns:
            Bytes of messages in the open chunk.
        """
        self._writer.add_message(
            self._channels[topic.name], stamp_ns, data, stamp_ns, sequence & 0xFFFFFFFF
        )
        self._open_bytes += len(data)
        return self._open_bytes

    def flush(self) -> None:
        """End the open chunk and hand everything to the kernel.

        Raises:
            OSError: that failed; the file has the whole chunks of before and perhaps more.
            FileNotFoundError: the file is no longer at its path.
        """
        self._writer.flush()
        self._whole_bytes, self._open_bytes = self._file.tell(), 0
        with suppress(FileNotFoundError, NotADirectoryError):
            if os.path.samestat(self._file_path.stat(), os.fstat(self._file.fileno())):
                return
        raise FileNotFoundError(errno.ENOENT, "its file was removed or moved away")

    def close(
        self, counts: Mapping[str, int], span_ns: tuple[int, int] | None, custom: Mapping[str, str]
    ) -> None:
        """Finish the MCAP file and write metadata.yaml.

        Args:
            counts: messages written a topic.
            span_ns: first and last stamp (None: no message).
            custom: the custom data of metadata.yaml.

        Raises:
            OSError: that failed.
        """
        information = self._information(counts, span_ns, dict(custom))
        self._writer.add_metadata("rosbag2", {"serialized_metadata": _yaml(information)})
        self._writer.finish()
        self._file.close()
        text = _yaml({"rosbag2_bagfile_information": information}) + "\n"
        part = self.path / "metadata.yaml.part"
        part.write_text(text, encoding="utf-8")
        part.replace(self.path / "metadata.yaml")

    def abandon(self) -> None:
        """After a failure: leave the whole chunks and, if there is room, a valid MCAP end."""
        if self._file.closed:
            return
        number = os.dup(self._file.fileno())
        with suppress(OSError):
            self._file.close()  # tries once more to write what is left in its buffer
        with suppress(OSError):
            os.ftruncate(number, self._whole_bytes)
            os.pwrite(number, _bare_end(), self._whole_bytes)
        os.close(number)

    def _information(
        self, counts: Mapping[str, int], span_ns: tuple[int, int] | None, custom: dict[str, str]
    ) -> dict[str, Any]:
        count = sum(counts.values())
        first_ns, last_ns = span_ns or (2**63 - 1, 2**63 - 1)
        start = {"nanoseconds_since_epoch": first_ns}
        duration = {"nanoseconds": last_ns - first_ns}
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
                    "message_count": counts[topic.name],
                }
                for topic in self._topics
            ],
            "compression_format": "",
            "compression_mode": "",
            "relative_file_paths": [self._file_path.name],
            "files": [
                {
                    "path": self._file_path.name,
                    "starting_time": start,
                    "duration": duration,
                    "message_count": count,
                }
            ],
            "custom_data": custom or None,
            "ros_distro": "jazzy",
        }
