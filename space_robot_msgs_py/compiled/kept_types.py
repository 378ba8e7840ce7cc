"""Numba's types of values, kept from one call of a kernel to the next.

A kernel called from Python asks for the types of its arguments. Numba makes those of functions, and
of tuples with functions, anew for every call, which takes longer than a law.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any
from weakref import WeakKeyDictionary

from numba.core.typing.typeof import typeof_impl


def keep_types(kind: type, key: Callable[[Any], Any]) -> None:
    """Let Numba keep the types of values of a class.

    Args:
        kind: the class.
        key: returns the part of a value that its type depends on; the type is kept as long as it.
    """
    of_numba = typeof_impl.dispatch(kind)
    types: WeakKeyDictionary[Any, Any] = WeakKeyDictionary()

    def type_of(value: Any, context: Any) -> Any:
        known = types.get(key(value))
        if known is None:
            known = types[key(value)] = of_numba(value, context)
        return known

    typeof_impl.register(kind, type_of)
