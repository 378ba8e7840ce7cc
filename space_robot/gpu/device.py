"""A device that runs programs of CUDA C++, and its memory."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.errors import SpaceRobotError

from .dlpack import capsule


class DeviceError(SpaceRobotError):
    """A device has failed."""


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

    def __dlpack__(
        self,
        *,
        stream: Any = None,
        max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None,
        copy: bool | None = None,
    ) -> Any:
        """Return the array for another library, which has the same memory.

        Programs have ended when this is called, so that no ``stream`` has to wait.

        Raises:
            BufferError: a copy is asked for, or another device.
        """
        if copy or dl_device not in (None, self.__dlpack_device__()):
            raise BufferError("an array on a device is given without a copy, and there")
        return capsule(self, self.pointer, self.shape, self.dtype, self.kind)

    @abstractmethod
    def read(self, rows: int | None = None) -> NDArray[Any]:
        """Return the numbers, of the first ``rows`` (None: of all)."""

    @abstractmethod
    def write(self, array: NDArray[Any], first: int = 0) -> None:
        """Overwrite rows from ``first`` on."""


class DeviceProgram(ABC):
    """A compiled program."""

    @property
    @abstractmethod
    def reserved_bytes(self) -> int:
        """Memory that the device keeps for local variables: for all threads that it can run."""

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
    def reserve(self, shape: tuple[int, ...], dtype: Any) -> Memory:
        """Return an array of any numbers on the device."""

    def store(self, array: NDArray[Any]) -> Memory:
        """Return a copy of an array on the device."""
        memory = self.reserve(array.shape, array.dtype)
        memory.write(array)
        return memory

    @property
    @abstractmethod
    def free_bytes(self) -> int:
        """Memory that is free."""
