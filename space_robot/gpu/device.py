"""A device that runs programs of CUDA C++, and its memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from .dlpack import capsule


class Memory(ABC):
    """An array on a device; it is freed with this object.

    Other libraries have it without a copy: ``torch.from_dlpack(memory)``.
    """

    pointer: int
    """Its address for programs."""
    shape: tuple[int, ...]
    dtype: np.dtype[Any]
    kind: int
    """Of the device, see `dlpack`."""

    def __dlpack_device__(self) -> tuple[int, int]:
        """Return kind and number of the device."""
        return self.kind, 0

    def __dlpack__(self, **options: Any) -> Any:
        """Return the array for another library, which has the same memory."""
        return capsule(self, self.pointer, self.shape, self.dtype, self.kind)

    @abstractmethod
    def read(self) -> NDArray[Any]:
        """Return the numbers."""

    @abstractmethod
    def write(self, array: NDArray[Any], first: int = 0) -> None:
        """Overwrite rows from ``first`` on."""


class DeviceProgram(ABC):
    """A compiled program."""

    @abstractmethod
    def run(self, function: str, count: int, argument: Memory) -> None:
        """Run a function of one argument by ``count`` threads, and wait for all of them."""


class Device(ABC):
    """Where flights are flown."""

    name: str

    @abstractmethod
    def compile(self, text: str) -> DeviceProgram:
        """Compile a program, or take it from the cache."""

    @abstractmethod
    def store(self, array: NDArray[Any]) -> Memory:
        """Return a copy of an array on the device."""

    @property
    @abstractmethod
    def free_bytes(self) -> int:
        """Memory that is free."""
