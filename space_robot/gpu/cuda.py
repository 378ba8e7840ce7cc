"""NVIDIA's devices, by the packages `cuda-bindings` and `nvidia-cuda-nvrtc`."""

from __future__ import annotations

import ctypes
import hashlib
import math
import weakref
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import click
import numpy as np
from numpy.typing import NDArray

from space_robot_msgs_py.compiled.cache import cache_directory
from space_robot_msgs_py.config.installation import install_command
from space_robot_msgs_py.errors import InputError

from ..console.files import atomic_file
from .device import Device, DeviceError, DeviceProgram, Memory
from .dlpack import CUDA

THREADS = 64
"""Of a block: the flights of a small batch are spread over the device."""
NVRTC_FLAGS = ("--fmad=false", "--std=c++17")
"""No fused operations: the bits are those of the operations as they are written."""
OLDEST_DRIVER, ITS_NUMBER = 13_000, "580"
"""The oldest driver, as CUDA and as NVIDIA number it."""


@cache
def find_device() -> Device:
    """Return the first NVIDIA device.

    Raises:
        InputError: there is none that can be used; says why.
    """
    how = install_command("gpu")
    try:
        from cuda.bindings import driver, nvrtc
    except ImportError:
        raise InputError(f"device gpu: cuda-bindings is not installed: {how}") from None
    try:
        _checked(nvrtc.nvrtcVersion())
    except RuntimeError:  # of the bindings, which have not found its library
        raise InputError(f"device gpu: nvidia-cuda-nvrtc is not installed: {how}") from None
    why = "its driver is not installed on this computer"
    try:
        _checked(driver.cuInit(0))
        if (version := _checked(driver.cuDriverGetVersion())) < OLDEST_DRIVER:
            has = f"{version // 1000}.{version % 1000 // 10}"
            why = f"its driver is made for CUDA {has}, {ITS_NUMBER} or newer is needed"
            raise DeviceError(why)
        return CudaDevice(_checked(driver.cuDeviceGet(0)))
    except DeviceError as error:
        raise InputError(f"device gpu: no NVIDIA device can be used: {error}") from None
    except RuntimeError:  # of the bindings, which have not found its library
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

        self.driver = driver
        self._context = _checked(driver.cuDevicePrimaryCtxRetain(number))
        name = _checked(driver.cuDeviceGetName(96, number))
        self.name = name.split(b"\0")[0].decode()
        kinds = driver.CUdevice_attribute

        def attribute(name: str) -> int:
            kind = getattr(kinds, f"CU_DEVICE_ATTRIBUTE_{name}")
            return int(_checked(driver.cuDeviceGetAttribute(kind, number)))

        major, minor = (attribute(f"COMPUTE_CAPABILITY_{part}") for part in ("MAJOR", "MINOR"))
        self.architecture = f"sm_{major}{minor}"
        self.threads = attribute("MULTIPROCESSOR_COUNT")
        self.threads *= attribute("MAX_THREADS_PER_MULTIPROCESSOR")
        """That run at a time at most."""
        self._programs: dict[str, CudaProgram] = {}

    @contextmanager
    def current(self) -> Iterator[Any]:
        """Make it the device of this thread for a while; yields the driver's functions."""
        _checked(self.driver.cuCtxPushCurrent(self._context))
        try:
            yield self.driver
        finally:
            self.driver.cuCtxPopCurrent()

    def compile(self, text: str) -> DeviceProgram:
        """Compile a program, or take it from the cache of compiled kernels.

        Raises:
            InputError: the compiler refuses it.
        """
        if text not in self._programs:
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
            self._programs[text] = CudaProgram(self, file.read_bytes())
        return self._programs[text]

    def reserve(self, shape: tuple[int, ...], dtype: Any) -> Memory:
        """Return an array of any numbers on the device."""
        return CudaMemory(self, shape, np.dtype(dtype))

    @property
    def free_bytes(self) -> int:
        """Memory that is free."""
        with self.current() as driver:
            free, _ = _checked(driver.cuMemGetInfo())
        return int(free)


class CudaMemory(Memory):
    """An array on an NVIDIA device."""

    kind = CUDA

    def __init__(self, device: CudaDevice, shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
        """Reserve the memory.

        Raises:
            DeviceError: there is too little.
        """
        self._device, self.shape, self.dtype = device, shape, dtype
        self._row = dtype.itemsize * math.prod(shape[1:])
        with device.current() as driver:
            # whole words, and some for an array without numbers
            size = max(8, dtype.itemsize * math.prod(shape))
            self.pointer = int(_checked(driver.cuMemAlloc(size)))
        weakref.finalize(self, _free, device, self.pointer)

    @property
    def __cuda_array_interface__(self) -> dict[str, Any]:
        """The array for libraries that know no DLPack."""
        interface = {"shape": self.shape, "typestr": self.dtype.str, "version": 3}
        return {**interface, "data": (self.pointer, False), "strides": None, "stream": None}

    def read(self, rows: int | None = None) -> NDArray[Any]:
        """Return the numbers, of the first ``rows`` (None: of all)."""
        array = np.empty(self.shape if rows is None else (rows, *self.shape[1:]), self.dtype)
        if array.nbytes:
            with self._device.current() as driver:
                place = driver.CUdeviceptr(self.pointer)
                _checked(driver.cuMemcpyDtoH(array.ctypes.data, place, array.nbytes))
        return array

    def write(self, array: NDArray[Any], first: int = 0) -> None:
        """Overwrite rows from ``first`` on."""
        numbers = np.ascontiguousarray(array, self.dtype)
        if numbers.nbytes:
            with self._device.current() as driver:
                place = driver.CUdeviceptr(self.pointer + first * self._row)
                _checked(driver.cuMemcpyHtoD(place, numbers.ctypes.data, numbers.nbytes))


def _free(device: CudaDevice, pointer: int) -> None:
    with device.current() as driver:
        driver.cuMemFree(driver.CUdeviceptr(pointer))


class CudaProgram(DeviceProgram):
    """A program on an NVIDIA device."""

    def __init__(self, device: CudaDevice, cubin: bytes) -> None:
        """Load a compiled program; it stays as long as the process."""
        self._device = device
        with device.current() as driver:
            self._module = _checked(driver.cuModuleLoadData(cubin))

    @property
    def reserved_bytes(self) -> int:
        """Memory that the device keeps for local variables: for all threads that it can run."""
        with self._device.current() as driver:
            count = _checked(driver.cuModuleGetFunctionCount(self._module))
            kernels = _checked(driver.cuModuleEnumerateFunctions(count, self._module))
            kind = driver.CUfunction_attribute.CU_FUNC_ATTRIBUTE_LOCAL_SIZE_BYTES
            each = [_checked(driver.cuFuncGetAttribute(kind, kernel)) for kernel in kernels]
        return int(max(each) * self._device.threads)

    def run(self, function: str, count: int, argument: Memory) -> None:
        """Run a function of one argument by ``count`` threads, and wait for all of them.

        Raises:
            DeviceError: the device has failed.
        """
        with self._device.current() as driver:
            kernel = _checked(driver.cuModuleGetFunction(self._module, function.encode()))
            blocks, arguments = -(-count // THREADS), ((argument.pointer,), (ctypes.c_void_p,))
            _checked(driver.cuCtxSynchronize())  # other libraries may still write what is read
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
    try:
        options = [flag.encode() for flag in (*flags, f"--gpu-architecture={architecture}")]
        (status,) = nvrtc.nvrtcCompileProgram(program, len(options), options)
        if status.value:
            log = bytes(_checked(nvrtc.nvrtcGetProgramLogSize(program)))
            _checked(nvrtc.nvrtcGetProgramLog(program, log))
            errors = [line for line in log.decode().splitlines() if "error" in line]
            why = "; ".join(errors[:3])
            raise InputError(f"device gpu: NVRTC cannot compile the flights: {why}")
        cubin = bytes(_checked(nvrtc.nvrtcGetCUBINSize(program)))
        _checked(nvrtc.nvrtcGetCUBIN(program, cubin))
    finally:
        nvrtc.nvrtcDestroyProgram(program)
    return cubin
