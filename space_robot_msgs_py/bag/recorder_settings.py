"""Parameters of recorder_node; `simulate` records by them, too."""

from __future__ import annotations

from typing import Annotated, ClassVar

from pydantic import ByteSize, Field, field_validator

from ..config.settings import NodeSettings
from .writer import Compression

LEAST_SPLIT_SIZE = 65_536
"""Every file has 20 kB of definitions and indexes, whatever its messages."""

LARGEST_SPLIT_SIZE = 2**62
"""A ROS parameter holds no more."""


class RecorderNodeSettings(NodeSettings):
    """Parameters of recorder_node."""

    node: ClassVar[str] = "recorder"

    bag: str = Field(
        "", description="folder of the bag to write; it must not exist (empty: bag_<time>)"
    )
    flight: str = Field(
        "{}", description="description of the flight, a JSON object; stored in the bag"
    )
    compression: Compression = Field("lz4", description="compression of the bag: none, lz4 or zstd")
    split_size: ByteSize = Field(
        ByteSize(0),
        description="size in bytes at which a new file of the bag starts, as 500K, 100M, 2G "
        "(powers of 1000) or 512KiB (0: one file)",
    )
    drain_period: Annotated[float, Field(ge=0.0005, le=0.1)] = Field(
        0.02, description="period of reading the queues, s"
    )

    @field_validator("split_size")
    @classmethod
    def _worth_a_file(cls, size: ByteSize) -> ByteSize:
        if size and not LEAST_SPLIT_SIZE <= size <= LARGEST_SPLIT_SIZE:
            raise ValueError(
                f"0 (one file) or {LEAST_SPLIT_SIZE} to {LARGEST_SPLIT_SIZE} bytes are allowed"
            )
        return size
