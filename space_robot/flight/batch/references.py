"""Desired motion of eight flights in lanes; that of a common mission is computed once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.lanes import WIDTH
from space_robot_msgs_py.compiled.records import Block
from space_robot_msgs_py.samples import Reference, ReferenceChunk

from ..plan import Flight

Array = NDArray[np.float64]


def chunks_of(flights: Sequence[Flight], start: int, stop: int) -> list[ReferenceChunk]:
    """Return the desired motion of each flight from tick ``start`` to ``stop``."""
    chunks: dict[int, ReferenceChunk] = {}
    for flight in flights:
        if id(flight.mission) not in chunks:
            chunks[id(flight.mission)] = flight.mission.chunk(start, stop - start)
    return [chunks[id(flight.mission)] for flight in flights]


def references_in_lanes(chunks: Sequence[ReferenceChunk], start: int, stop: int) -> Block:
    """Return the ticks ``start`` to ``stop`` of up to eight chunks as a block in lanes.

    A lane without a flight has the first one's.
    """
    block: Block = np.empty(stop - start, Reference.dtype(chunks[0].joints.shape[2], WIDTH))
    numbers = block.view(np.float64).reshape(stop - start, -1, WIDTH)
    if all(chunk is chunks[0] for chunk in chunks):
        numbers[:] = _numbers(chunks[0], start, stop)[:, :, np.newaxis]
        return block
    for lane in range(WIDTH):
        numbers[:, :, lane] = _numbers(chunks[lane if lane < len(chunks) else 0], start, stop)
    return block


def _numbers(chunk: ReferenceChunk, start: int, stop: int) -> Array:
    rows = slice(start - chunk.start, stop - chunk.start)
    part = ReferenceChunk(start, chunk.joints[rows], chunk.base[rows])
    return part.references().view(np.float64).reshape(stop - start, -1)
