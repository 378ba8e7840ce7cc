"""Extraction of numbers from many messages at once, for any layout.

The first message of a layout is decoded the general way; it tells where the numbers stand in all
that are laid out alike.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from ..errors import MessageError
from ..wire.messages import MessageDescription, Numbers
from .batch import Batch
from .kernels import gather

Array = NDArray[np.float64]
Places = NDArray[np.intp]


class FieldReader:
    """Reader of the numbers in the messages of a topic."""

    def __init__(self, description: MessageDescription) -> None:
        self._description = description
        self.columns = description.columns
        """The columns that the numbers of a row belong to."""
        self._known: Numbers | None = None
        self.misfits = 0
        """Number of messages that could not be read."""
        self.fault = ""
        """Reason why the first of these could not be read."""

    def read(self, batch: Batch) -> Iterator[tuple[Places, Array]]:
        """For each layout, the messages' places in the batch and their (M, width) numbers."""
        left: Places = np.arange(len(batch))
        while len(left):
            if self._known:
                fits, values = _take(self._known, batch, left)
                if fits.any():
                    yield (left, values) if fits.all() else (left[fits], values[fits])
                    left = left[~fits]
                    continue
            try:
                self._known = self._description.learn(batch.message(left[0]))
                yield left[:1], self._known.values[None]
            except MessageError as error:
                self.misfits += 1
                self.fault = self.fault or str(error)
            left = left[1:]


def _take(numbers: Numbers, batch: Batch, left: Places) -> tuple[NDArray[np.bool_], Array]:
    """Tell which of the messages ``left`` are laid out so, with a row of numbers for each."""
    values = np.empty((len(left), len(numbers.offsets)))
    fits = np.empty(len(left), np.bool_)
    gather(
        batch.data,
        batch.starts[left],
        batch.lengths[left],
        numbers.layout.pattern,
        numbers.offsets,
        values,
        fits,
    )
    return fits, values
