"""NVIDIA's devices, by the packages `cuda-bindings` and `nvidia-cuda-nvrtc`."""

from __future__ import annotations

import ctypes
import hashlib
import weakref
from collections.abc import Sequence
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError, SpaceRobotError

from ..console.files import atomic_file
from .device import Device, DeviceProgram, Memory
from .dlpack import CUDA

THREADS = 64
"""Of a block: the flights of a small batch are spread over the device."""
NVRTC_FLAGS = ("--fmad=false", "--std=c++17")
"""No fused operations: the bits are those of the operations as they are written."""


class DeviceError(SpaceRobotError):
    """A device has failed."""


@cache
def find_device() -> Device:
    """Return the first NVIDIA device.

    Raises:
        InputError: there is none that can be used; says why.
    """
    try:
        from cuda.bindings import driver, nvrtc  # noqa: F401
    except ImportError:
        how = install_command("gpu")
        raise InputError(f"device gpu: cuda-bindings is not installed: {how}") from None
    try:
        _checked(driver.cuInit(0))
        return CudaDevice(_checked(driver.cuDeviceGet(0)))
    except DeviceError as error:
        raise InputError(f"device gpu: no NVIDIA device can be used: {error}") from None
    except RuntimeError:  # of the bindings, which have not found the driver's library
        why = "its driver is not installed on this computer"
        raise InputError(f"device gpu: no NVIDIA device can be used: {why}") from None


def _checked(result: tuple[Any, ...]) -> Any:
    """Return what a call returned."""
    status, *values = result
    if status.value:
        raise DeviceError(status.name.removeprefix("CUDA_ERROR_").replace("_", " ").lower())
    return values[0] if len(values) == 1 else values


class CudaDevice(Device):
    """One NVIDIA device, in the context that other libraries of this process use, too."""

    def __init__(self, number: Any) -> None:
        """Take a device of the driver."""
        from cuda.bindings import driver

        self._driver = driver
        self._context = _checked(driver.cuDevicePrimaryCtxRetain(number))
        self.use()
        name = _checked(driver.cuDeviceGetName(96, number))
        self.name = name.split(b"\0")[0].decode()
        kind = driver.CUdevice_attribute
        major, minor = (
            _checked(driver.cuDeviceGetAttribute(attribute, number))
            for attribute in (
                kind.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MAJOR,
                kind.CU_DEVICE_ATTRIBUTE_COMPUTE_CAPABILITY_MINOR,
            )
        )
        self.architecture = f"sm_{major}{minor}"

    def use(self) -> None:
        """Make it the device of this thread."""
        _checked(self._driver.cuCtxSetCurrent(self._context))

    def compile(self, text: str) -> DeviceProgram:
        """Compile a program, or take it from the cache of compiled kernels.

        Raises:
            InputError: the compiler refuses it.
        """
        self.use()
        file = program_file(text, self.architecture)
        if not file.exists():
            click.echo(
                f"compiling the flights' program for {self.name} (once for a robot and a law, "
                "up to a minute) ...",
                err=True,
            )
            file.parent.mkdir(parents=True, exist_ok=True)
            with atomic_file(file, replace=True) as cubin:
                cubin.write(compiled(text, self.architecture))
        return CudaProgram(self, _checked(self._driver.cuModuleLoadData(file.read_bytes())))

    def store(self, array: NDArray[Any]) -> Memory:
        """Return a copy of an array on the device."""
        self.use()
        return CudaMemory(self._driver, np.ascontiguousarray(array))

    @property
    def free_bytes(self) -> int:
        """Memory that is free."""
        self.use()
        free, _ = _checked(self._driver.cuMemGetInfo())
        return int(free)


class CudaMemory(Memory):
    """An array on an NVIDIA device."""

    kind = CUDA

    def __init__(self, driver: Any, array: NDArray[Any]) -> None:
        """Copy an array."""
        self._driver, self.dtype, self.shape = driver, array.dtype, array.shape
        self._bytes = max(array.nbytes, 1)
        self._row = array.itemsize * int(np.prod(array.shape[1:], dtype=int))
        self._address = _checked(driver.cuMemAlloc(self._bytes))
        self.pointer = int(self._address)
        self._end = weakref.finalize(self, driver.cuMemFree, self._address)
        self.write(array)

    def read(self) -> NDArray[Any]:
        """Return the numbers."""
        array = np.empty(self.shape, self.dtype)
        if array.nbytes:
            _checked(self._driver.cuMemcpyDtoH(array.ctypes.data, self._address, array.nbytes))
        return array

    def write(self, array: NDArray[Any], first: int = 0) -> None:
        """Overwrite rows from ``first`` on."""
        numbers = np.ascontiguousarray(array)
        if numbers.nbytes:
            place = self._driver.CUdeviceptr(self.pointer + first * self._row)
            _checked(self._driver.cuMemcpyHtoD(place, numbers.ctypes.data, numbers.nbytes))


class CudaProgram(DeviceProgram):
    """A program on an NVIDIA device."""

    def __init__(self, device: CudaDevice, module: Any) -> None:
        """Take a module that is loaded."""
        self._device, self._module = device, module

    def run(self, function: str, count: int, argument: Memory) -> None:
        """Run a function of one argument by ``count`` threads, and wait for all of them.

        Raises:
            DeviceError: the device has failed.
        """
        self._device.use()
        driver = self._device._driver
        kernel = _checked(driver.cuModuleGetFunction(self._module, function.encode()))
        blocks, arguments = -(-count // THREADS), ((argument.pointer,), (ctypes.c_void_p,))
        _checked(driver.cuLaunchKernel(kernel, blocks, 1, 1, THREADS, 1, 1, 0, 0, arguments, 0))
        _checked(driver.cuCtxSynchronize())


def program_file(text: str, architecture: str) -> Path:
    """Return where a compiled program is kept."""
    from cuda.bindings import nvrtc

    version = _checked(nvrtc.nvrtcVersion())
    digest = hashlib.sha256(repr((version, architecture, NVRTC_FLAGS)).encode() + text.encode())
    return cache_directory() / "gpu" / f"{digest.hexdigest()[:32]}.cubin"


def compiled(text: str, architecture: str, flags: Sequence[str] = NVRTC_FLAGS) -> bytes:
    """Compile a program by NVRTC, which needs no device.

    Raises:
        InputError: the compiler refuses it; the first errors are told.
    """
    from cuda.bindings import nvrtc

    program = _checked(nvrtc.nvrtcCreateProgram(text.encode(), b"flights.cu", 0, [], []))
    options = [flag.encode() for flag in (*flags, f"--gpu-architecture={architecture}")]
    (status,) = nvrtc.nvrtcCompileProgram(program, len(options), options)
    if status.value:
        log = bytes(_checked(nvrtc.nvrtcGetProgramLogSize(program)))
        _checked(nvrtc.nvrtcGetProgramLog(program, log))
        errors = [line for line in log.decode().splitlines() if "error" in line]
        raise InputError(f"device gpu: NVRTC cannot compile the flights: {'; '.join(errors[:3])}")
    cubin = bytes(_checked(nvrtc.nvrtcGetCUBINSize(program)))
    _checked(nvrtc.nvrtcGetCUBIN(program, cubin))
    return cubin
