"""The programs of a device compiled as C++ for this processor, where a loop stands for threads."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot.gpu.device import Device, DeviceProgram, Memory
from space_robot.gpu.dlpack import CPU

FLAGS = ("-std=c++17", "-O0", "-ffp-contract=off", "-shared", "-fPIC", "-Werror")


class CpuMemory(Memory):
    """An array of this process."""

    kind = CPU

    def __init__(self, shape: tuple[int, ...], dtype: Any) -> None:
        self.array = np.empty(shape, dtype)
        self.pointer = self.array.ctypes.data
        self.shape, self.dtype = self.array.shape, self.array.dtype

    def read(self, rows: int | None = None) -> NDArray[Any]:
        return self.array[:rows].copy()

    def write(self, array: NDArray[Any], first: int = 0) -> None:
        self.array[first : first + len(array)] = array


class CpuProgram(DeviceProgram):
    """A library of functions."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library

    @property
    def reserved_bytes(self) -> int:
        return 0

    def run(self, function: str, count: int, argument: Memory) -> None:
        self._library[function](ctypes.c_void_p(argument.pointer))


class CpuDevice(Device):
    """This processor."""

    name = "this processor"

    def __init__(self, free_bytes: int = 8 << 30) -> None:
        self._free_bytes = free_bytes
        self.texts: list[str] = []
        """Of the programs that were compiled."""

    def compile(self, text: str) -> DeviceProgram:
        self.texts.append(text)
        with tempfile.TemporaryDirectory() as folder:
            source, library = Path(folder) / "flights.cpp", Path(folder) / "flights.so"
            source.write_text(text, "utf-8")
            subprocess.run(["g++", *FLAGS, str(source), "-o", str(library)], check=True)
            return CpuProgram(ctypes.CDLL(str(library)))

    def reserve(self, shape: tuple[int, ...], dtype: Any) -> Memory:
        return CpuMemory(shape, dtype)

    @property
    def free_bytes(self) -> int:
        return self._free_bytes
