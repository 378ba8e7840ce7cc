"""Memory of flights as C++ has it: the fields of records that are used, in exact sizes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from numpy.typing import NDArray

from space_robot_control.flight_code.software import numbers_of

Structs = NDArray[Any]
"""An array (F,) of structs of doubles."""


def pack(blocks: Structs, structs: Structs) -> None:
    """Copy records (F,) into structs (F,) of some of their fields."""
    for name in structs.dtype.names or ():
        target = structs[name]
        if target.dtype.names:
            pack(blocks[name], target)
        else:
            target[...] = numbers_of(target.shape, blocks[name])


def unpack(structs: Structs, blocks: Structs) -> None:
    """Copy structs (F,) back into records (F,); what is in no struct stays."""
    for name in structs.dtype.names or ():
        source = structs[name]
        if source.dtype.names:
            unpack(source, blocks[name])
        else:
            numbers_of(source.shape, blocks[name])[...] = source


def packed(blocks: Structs, dtype: np.dtype[Any]) -> Structs:
    """Return records (F,) as structs."""
    structs = np.zeros(len(blocks), dtype)
    pack(blocks, structs)
    return structs


def argument_struct(numbers: Mapping[str, float], pointers: Mapping[str, int]) -> Structs:
    """Return a program's argument (1,): numbers, integers as such, then addresses of arrays."""
    fields: list[tuple[str, Any]] = [
        (name, np.int64 if isinstance(number, int) else np.float64)
        for name, number in numbers.items()
    ]
    fields += [(name, np.uint64) for name in pointers]
    return np.array([(*numbers.values(), *pointers.values())], fields)
