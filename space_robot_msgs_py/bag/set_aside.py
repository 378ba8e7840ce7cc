"""A bag moved out of the way of the one that takes its name."""

from __future__ import annotations

from itertools import count
from pathlib import Path

from ..errors import InputError


def set_aside(bag: Path) -> Path:
    """Rename a bag that is closed to ``<bag>_before_reset_<number>``, the first free; return that.

    Raises:
        InputError: it cannot be renamed.
    """
    names = (bag.with_name(f"{bag.name}_before_reset_{number}") for number in count(1))
    free = next(name for name in names if not name.exists())
    try:
        return bag.rename(free)
    except OSError as error:
        raise InputError(f"{bag}: cannot be renamed to {free.name} ({error.strerror})") from None
