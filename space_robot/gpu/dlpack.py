"""Arrays for other libraries by DLPack, without a copy: https://dmlc.github.io/dlpack."""

from __future__ import annotations

import ctypes
from typing import Any

import numpy as np

CPU, CUDA = 1, 2
"""Kinds of devices."""
CODES = {"i": 0, "u": 1, "f": 2, "b": 6}
"""Of the types of numbers, by NumPy's."""
NAME = b"dltensor"


class _Tensor(ctypes.Structure):
    _fields_ = (
        ("data", ctypes.c_void_p),
        ("kind", ctypes.c_int32),
        ("number", ctypes.c_int32),
        ("dimensions", ctypes.c_int32),
        ("code", ctypes.c_uint8),
        ("bits", ctypes.c_uint8),
        ("lanes", ctypes.c_uint16),
        ("shape", ctypes.POINTER(ctypes.c_int64)),
        ("strides", ctypes.POINTER(ctypes.c_int64)),
        ("offset", ctypes.c_uint64),
    )


class _Managed(ctypes.Structure):
    _fields_ = (("tensor", _Tensor), ("context", ctypes.c_void_p), ("delete", ctypes.c_void_p))


_DELETER = ctypes.CFUNCTYPE(None, ctypes.c_void_p)
_in_use: dict[int, tuple[Any, ...]] = {}
"""What the consumers of capsules need, by the capsules' addresses."""


@_DELETER  # type: ignore[untyped-decorator,unused-ignore]
def _delete(address: int) -> None:
    _in_use.pop(address, None)


def capsule(
    owner: Any, pointer: int, shape: tuple[int, ...], dtype: np.dtype[Any], kind: int
) -> Any:
    """Return a DLPack capsule of an array in C order, whose ``owner`` lives as long as it is used.

    Args:
        owner: of the memory.
        pointer: to the first number.
        shape: of the array.
        dtype: of its numbers.
        kind: `CPU` or `CUDA`.
    """
    sizes = (ctypes.c_int64 * len(shape))(*shape)
    managed = _Managed()
    managed.tensor = _Tensor(
        pointer, kind, 0, len(shape), CODES[dtype.kind], 8 * dtype.itemsize, 1, sizes, None, 0
    )
    managed.delete = ctypes.cast(_delete, ctypes.c_void_p)
    address = ctypes.addressof(managed)
    _in_use[address] = owner, managed, sizes
    make = ctypes.pythonapi.PyCapsule_New
    make.restype, make.argtypes = (
        ctypes.py_object,
        (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p),
    )
    return make(address, NAME, None)
