"""Arrays for other libraries by DLPack, without a copy: https://dmlc.github.io/dlpack."""

from __future__ import annotations

import ctypes
import itertools
from typing import Any

import numpy as np

CPU, CUDA = 1, 2
"""Kinds of devices."""
CODES = {"i": 0, "u": 1, "f": 2, "b": 6}
"""Of the types of numbers, by NumPy's."""
UNUSED = b"dltensor"
"""Name of a capsule that no library has taken yet."""


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


_in_use: dict[int, tuple[Any, ...]] = {}
"""What those who have taken capsules need, by address."""
_api = ctypes.pythonapi
_api.PyCapsule_New.restype = ctypes.py_object
_api.PyCapsule_New.argtypes = (ctypes.c_void_p, ctypes.c_char_p, ctypes.c_void_p)
_api.PyCapsule_IsValid.argtypes = (ctypes.c_void_p, ctypes.c_char_p)
_api.PyCapsule_GetPointer.restype = ctypes.c_void_p
_api.PyCapsule_GetPointer.argtypes = (ctypes.c_void_p, ctypes.c_char_p)


def _delete(address: int, in_use: dict[int, tuple[Any, ...]] = _in_use) -> None:
    in_use.pop(address, None)


def _end(capsule: int, api: Any = _api, in_use: dict[int, tuple[Any, ...]] = _in_use) -> None:
    if api.PyCapsule_IsValid(capsule, UNUSED):  # nobody else deletes it
        in_use.pop(api.PyCapsule_GetPointer(capsule, UNUSED), None)


# libraries may call them when the interpreter ends
_CALLBACKS = [ctypes.CFUNCTYPE(None, ctypes.c_void_p)(call) for call in (_delete, _end)]
_DELETE, _END = (ctypes.cast(callback, ctypes.c_void_p) for callback in _CALLBACKS)
for _callback in _CALLBACKS:
    _api.Py_IncRef(ctypes.py_object(_callback))


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
    steps = list(itertools.accumulate((1, *shape[:0:-1]), lambda a, b: a * b))[::-1]
    sizes, strides = ((ctypes.c_int64 * len(shape))(*numbers) for numbers in (shape, steps))
    code, bits = CODES[dtype.kind], 8 * dtype.itemsize
    tensor = _Tensor(pointer, kind, 0, len(shape), code, bits, 1, sizes, strides, 0)
    managed = _Managed(tensor, None, _DELETE)
    address = ctypes.addressof(managed)
    _in_use[address] = owner, managed, sizes, strides
    return _api.PyCapsule_New(address, UNUSED, _END)
