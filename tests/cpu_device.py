"""The device's programs compiled as C++ for this processor, where a loop stands for threads."""

from __future__ import annotations

import ctypes
import subprocess
import tempfile
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot.gpu.device import Device, Memory, Program

FLAGS = ("-std=c++17", "-O1", "-ffp-contract=off", "-fno-tree-vectorize", "-shared", "-fPIC", "-w")


class CpuMemory(Memory):
    """An array of this process."""

    def __init__(self, array: NDArray[Any]) -> None:
        self.array = np.ascontiguousarray(array).copy()
        self.pointer = self.array.ctypes.data

    def read(self) -> NDArray[Any]:
        return self.array.copy()

    def write(self, array: NDArray[Any], first: int = 0) -> None:
        self.array[first : first + len(array)] = array


class CpuProgram(Program):
    """A library of functions."""

    def __init__(self, library: ctypes.CDLL) -> None:
        self._library = library

    def run(self, function: str, count: int, argument: Memory) -> None:
        self._library[function](ctypes.c_void_p(argument.pointer))


class CpuDevice(Device):
    """This processor."""

    name = "this processor"
    free_bytes = 8 << 30

    def compile(self, text: str) -> Program:
        with tempfile.TemporaryDirectory() as folder:
            source, library = Path(folder) / "loop.cpp", Path(folder) / "loop.so"
            source.write_text(text, "utf-8")
            subprocess.run(["g++", *FLAGS, str(source), "-o", str(library)], check=True)
            return CpuProgram(ctypes.CDLL(str(library)))

    def store(self, array: NDArray[Any]) -> Memory:
        return CpuMemory(array)
