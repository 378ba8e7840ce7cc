"""Memory of flights as C++ has it: the fields of records that are used, in exact sizes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Structs = NDArray[Any]
"""An array (F,) of structs of doubles."""


def pack(blocks: Structs, structs: Structs) -> None:
    """Copy records (F,) into structs (F,) of some of their fields."""
    for name in structs.dtype.names or ():
        target = structs[name]
        if target.dtype.names:
            pack(blocks[name], target)
        else:
            target[...] = blocks[name][_part(target)]


def unpack(structs: Structs, blocks: Structs) -> None:
    """Copy structs (F,) back into records (F,); what is in no struct stays."""
    for name in structs.dtype.names or ():
        source = structs[name]
        if source.dtype.names:
            unpack(source, blocks[name])
        else:
            blocks[name][_part(source)] = source


def packed(blocks: Structs, dtype: np.dtype[Any]) -> Structs:
    """Return records (F,) as structs."""
    structs = np.zeros(len(blocks), dtype)
    pack(blocks, structs)
    return structs


def _part(array: NDArray[Any]) -> tuple[slice, ...]:
    return tuple(slice(0, size) for size in array.shape)
